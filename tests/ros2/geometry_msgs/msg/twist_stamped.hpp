#pragma once
#include <string>
#include <vector>

#include "rclcpp/rclcpp.hpp"

namespace geometry_msgs::msg
{
struct TwistStamped {
  struct Header { rclcpp::Time stamp; std::string frame_id; };
  Header header; struct { struct { double x{}, y{}, z{}; } linear, angular; } twist;
};
}  // namespace geometry_msgs::msg
