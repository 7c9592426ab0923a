# STUB of rclcpp_lifecycle for romc's tests, not ROS.
if(NOT TARGET rclcpp_lifecycle::rclcpp_lifecycle)
  add_library(rclcpp_lifecycle::rclcpp_lifecycle INTERFACE IMPORTED)
  target_include_directories(rclcpp_lifecycle::rclcpp_lifecycle INTERFACE "${CMAKE_CURRENT_LIST_DIR}/../include")
endif()
