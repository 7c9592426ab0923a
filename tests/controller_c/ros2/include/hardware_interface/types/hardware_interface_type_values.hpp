// STUB for romc's tests, not ROS: see rclcpp/stub.hpp.
#ifndef ROMC_STUB_TYPE_VALUES
#define ROMC_STUB_TYPE_VALUES

namespace hardware_interface
{
constexpr char HW_IF_POSITION[] = "position";
constexpr char HW_IF_VELOCITY[] = "velocity";
constexpr char HW_IF_EFFORT[] = "effort";
}  // namespace hardware_interface

#endif
