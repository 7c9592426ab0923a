// STUB for romc's tests, not ROS: see rclcpp/stub.hpp.
#ifndef ROMC_STUB_CONTROLLER_INTERFACE
#define ROMC_STUB_CONTROLLER_INTERFACE

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "rclcpp/stub.hpp"

namespace hardware_interface
{

/// A value with its full name, which a hardware component would own.
struct Handle
{
    std::string name;
    double value = 0;
};

class LoanedStateInterface
{
public:
    explicit LoanedStateInterface(const Handle & handle) : handle_(&handle) {}
    std::string get_name() const { return handle_->name; }
#ifdef ROMC_STUB_HUMBLE
    double get_value() const { return handle_->value; }
#else
    template <typename T = double>
    [[nodiscard]] std::optional<T> get_optional(unsigned int = 10) const
    {
        return handle_->value;
    }
#endif

private:
    const Handle * handle_;
};

class LoanedCommandInterface
{
public:
    explicit LoanedCommandInterface(Handle & handle) : handle_(&handle) {}
    const std::string & get_name() const { return handle_->name; }
#ifdef ROMC_STUB_HUMBLE
    void set_value(double value) { handle_->value = value; }
#else
    template <typename T>
    [[nodiscard]] bool set_value(const T & value, unsigned int = 10)
    {
        handle_->value = value;
        return true;
    }
#endif

private:
    Handle * handle_;
};

}  // namespace hardware_interface

namespace controller_interface
{

enum class CallbackReturn : uint8_t { SUCCESS = 97, FAILURE = 98, ERROR = 99 };
enum class return_type : uint8_t { OK = 0, ERROR = 1 };
enum class interface_configuration_type : uint8_t { ALL = 0, INDIVIDUAL = 1, NONE = 2 };

struct InterfaceConfiguration
{
    interface_configuration_type type;
    std::vector<std::string> names = {};
};

class ControllerInterface
{
public:
    virtual ~ControllerInterface() = default;
    virtual CallbackReturn on_init() = 0;
    virtual InterfaceConfiguration command_interface_configuration() const = 0;
    virtual InterfaceConfiguration state_interface_configuration() const = 0;
    virtual CallbackReturn on_configure(const rclcpp_lifecycle::State & previous) = 0;
    virtual CallbackReturn on_activate(const rclcpp_lifecycle::State & previous) = 0;
    virtual CallbackReturn on_deactivate(const rclcpp_lifecycle::State & previous) = 0;
    virtual return_type update(const rclcpp::Time & time, const rclcpp::Duration & period) = 0;

    void assign_interfaces(
        std::vector<hardware_interface::LoanedCommandInterface> && commands,
        std::vector<hardware_interface::LoanedStateInterface> && states)
    {
        command_interfaces_ = std::move(commands);
        state_interfaces_ = std::move(states);
    }

    std::shared_ptr<rclcpp_lifecycle::LifecycleNode> get_node() const { return node_; }

protected:
    /// A value that was set before stays, as one of a parameter file does.
    template <typename T>
    T auto_declare(const std::string & name, const T & value)
    {
        return std::get<T>(node_->values.emplace(name, value).first->second);
    }

    std::vector<hardware_interface::LoanedCommandInterface> command_interfaces_;
    std::vector<hardware_interface::LoanedStateInterface> state_interfaces_;

private:
    std::shared_ptr<rclcpp_lifecycle::LifecycleNode> node_ = std::make_shared<rclcpp_lifecycle::LifecycleNode>();
};

}  // namespace controller_interface

#endif
