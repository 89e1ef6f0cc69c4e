#pragma once
#include <string>
#include <vector>

#include "rclcpp/rclcpp.hpp"

namespace std_msgs::msg
{
struct Float64MultiArray {
  struct Header { rclcpp::Time stamp; std::string frame_id; };
  std::vector<double> data;
};
}  // namespace std_msgs::msg
