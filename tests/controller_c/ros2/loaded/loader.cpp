// The plugin from its installed description, by pluginlib; its library is unloaded with it.
#include <memory>

#include "controller_interface/controller_interface.hpp"
#include "pluginlib/class_loader.hpp"

using controller_interface::ControllerInterface;

std::shared_ptr<ControllerInterface> new_plugin();

std::shared_ptr<ControllerInterface> new_plugin()
{
    auto loader = std::make_shared<pluginlib::ClassLoader<ControllerInterface>>(
        "controller_interface", "controller_interface::ControllerInterface");
    auto plugin = loader->createSharedInstance(PLUGIN);
    return {plugin.get(), [loader, plugin](ControllerInterface *) mutable { plugin.reset(); }};
}
