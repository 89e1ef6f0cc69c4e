#pragma once
#include <string>
#include <vector>

#include "rclcpp/rclcpp.hpp"

namespace geometry_msgs::msg
{
struct PoseStamped {
  struct Header { rclcpp::Time stamp; std::string frame_id; };
  Header header; struct { struct { double x{}, y{}, z{}; } position; struct { double x{}, y{}, z{}, w{1}; } orientation; } pose;
};
}  // namespace geometry_msgs::msg
