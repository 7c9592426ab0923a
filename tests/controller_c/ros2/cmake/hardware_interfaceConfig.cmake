# STUB of hardware_interface for romc's tests, not ROS.
if(NOT TARGET hardware_interface::hardware_interface)
  add_library(hardware_interface::hardware_interface INTERFACE IMPORTED)
  target_include_directories(hardware_interface::hardware_interface INTERFACE "${CMAKE_CURRENT_LIST_DIR}/../include")
endif()
