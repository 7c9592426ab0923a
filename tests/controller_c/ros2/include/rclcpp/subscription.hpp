// STUB for romc's tests, not ROS: see stub.hpp.
#include "rclcpp/stub.hpp"
