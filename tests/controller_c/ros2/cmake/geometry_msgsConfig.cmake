# STUB of geometry_msgs for romc's tests, not ROS.
if(NOT TARGET geometry_msgs::geometry_msgs)
  add_library(geometry_msgs::geometry_msgs INTERFACE IMPORTED)
  target_include_directories(geometry_msgs::geometry_msgs INTERFACE "${CMAKE_CURRENT_LIST_DIR}/../include")
endif()
set(geometry_msgs_TARGETS geometry_msgs::geometry_msgs)
