# STUB of ament_cmake for romc's tests, not ROS.
function(ament_package)
endfunction()
