// STUB for romc's tests, not ROS: see rclcpp/stub.hpp. A function makes the plugin, where pluginlib has a loader.
#ifndef ROMC_STUB_PLUGINLIB
#define ROMC_STUB_PLUGINLIB

#define PLUGINLIB_EXPORT_CLASS(Class, Base) \
    std::shared_ptr<Base> new_plugin(); \
    std::shared_ptr<Base> new_plugin() \
    { \
        return std::make_shared<Class>(); \
    }

#endif
