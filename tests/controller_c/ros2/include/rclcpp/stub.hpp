// STUB of the few ROS declarations that the generated plugin uses, for romc's tests: not ROS. ROMC_STUB_HUMBLE gives the
// interfaces of ROS 2 Humble, without it those of later releases.
#ifndef ROMC_STUB_RCLCPP
#define ROMC_STUB_RCLCPP

#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

namespace rclcpp
{

class Duration
{
public:
    explicit Duration(int64_t ns) : ns_(ns) {}
    double seconds() const { return static_cast<double>(ns_) * 1e-9; }

private:
    int64_t ns_;
};

class Time
{
public:
    explicit Time(int64_t ns) : ns_(ns) {}
    int64_t nanoseconds() const { return ns_; }

private:
    int64_t ns_;
};

/// Keeps the last message.
struct Logger
{
    std::string * last;
};

__attribute__((format(printf, 2, 3))) inline void log(const Logger & logger, const char * format, ...)
{
    char text[512];
    va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    *logger.last = text;
}

using Value = std::variant<bool, int64_t, double, std::string, std::vector<std::string>>;

class Parameter
{
public:
    explicit Parameter(Value value) : value_(std::move(value)) {}
    bool as_bool() const { return std::get<bool>(value_); }
    int64_t as_int() const { return std::get<int64_t>(value_); }
    double as_double() const { return std::get<double>(value_); }
    std::string as_string() const { return std::get<std::string>(value_); }
    std::vector<std::string> as_string_array() const { return std::get<std::vector<std::string>>(value_); }

private:
    Value value_;
};

struct SystemDefaultsQoS
{
};

/// A topic's callback; the node keeps none of its own.
template <class Message>
struct Subscription
{
    using SharedPtr = std::shared_ptr<Subscription>;
    std::string topic;
    std::function<void(const Message &)> callback;
};

}  // namespace rclcpp

namespace rclcpp_lifecycle
{

class State
{
};

class LifecycleNode
{
public:
    rclcpp::Logger get_logger() const { return {last.get()}; }
    rclcpp::Parameter get_parameter(const std::string & name) const { return rclcpp::Parameter(values.at(name)); }

    template <class Message, class Callback>
    std::shared_ptr<rclcpp::Subscription<Message>> create_subscription(
        const std::string & topic, const rclcpp::SystemDefaultsQoS &, Callback && callback)
    {
        auto made = std::make_shared<rclcpp::Subscription<Message>>();
        made->topic = topic;
        made->callback = callback;
        subscription = made;
        return made;
    }

    std::map<std::string, rclcpp::Value> values;
    /// The last subscription that was made, of any message.
    std::weak_ptr<void> subscription;
    std::shared_ptr<std::string> last = std::make_shared<std::string>();
};

}  // namespace rclcpp_lifecycle

#define RCLCPP_ERROR(logger, ...) rclcpp::log(logger, __VA_ARGS__)
#define RCLCPP_INFO(logger, ...) rclcpp::log(logger, __VA_ARGS__)

#endif
