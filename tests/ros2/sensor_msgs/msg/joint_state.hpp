#pragma once
#include <string>
#include <vector>

#include "rclcpp/rclcpp.hpp"

namespace sensor_msgs::msg
{
struct JointState {
  struct Header { rclcpp::Time stamp; std::string frame_id; };
  Header header; std::vector<std::string> name; std::vector<double> position, velocity, effort;
};
}  // namespace sensor_msgs::msg
