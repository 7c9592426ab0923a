# STUB of controller_interface for romc's tests, not ROS.
if(NOT TARGET controller_interface::controller_interface)
  add_library(controller_interface::controller_interface INTERFACE IMPORTED)
  target_include_directories(controller_interface::controller_interface INTERFACE "${CMAKE_CURRENT_LIST_DIR}/../include")
endif()
