// STUB for romc's tests, not ROS: see rclcpp/stub.hpp.
#include "rclcpp/stub.hpp"
