# STUB of pluginlib for romc's tests, not ROS.
if(NOT TARGET pluginlib::pluginlib)
  add_library(pluginlib::pluginlib INTERFACE IMPORTED)
  target_include_directories(pluginlib::pluginlib INTERFACE "${CMAKE_CURRENT_LIST_DIR}/../include")
endif()
function(pluginlib_export_plugin_description_file category file)
  install(FILES ${file} DESTINATION share/${PROJECT_NAME})
endfunction()
