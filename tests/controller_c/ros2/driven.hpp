// The generated plugin of ros2_control with interfaces of its own, as a controller manager would drive it, on stubs of ROS.
#ifndef ROMC_DRIVEN
#define ROMC_DRIVEN

#include JUMP

#include <cmath>
#include <cstdlib>
#include <memory>
#include <new>

#include "controller.hpp"

#define PASTE_(a, b) a##b
#define PASTE(a, b) PASTE_(a, b)
#define FN(suffix) PASTE(NAME, suffix)

using controller_interface::CallbackReturn;
using controller_interface::ControllerInterface;
using controller_interface::return_type;
using hardware_interface::Handle;
using hardware_interface::LoanedCommandInterface;
using hardware_interface::LoanedStateInterface;

// By pluginlib, or by the stub in its place.
std::shared_ptr<ControllerInterface> new_plugin();

namespace
{
long allocations = 0;
bool is_counted = false;
}  // namespace

// Not inlined: compilers would see memory of one function freed by another.
[[gnu::noinline]] void * operator new(std::size_t size)
{
    allocations += is_counted;
    if (void * memory = std::malloc(size)) {
        return memory;
    }
    throw std::bad_alloc();
}

[[gnu::noinline]] void operator delete(void * memory) noexcept
{
    std::free(memory);
}

[[gnu::noinline]] void operator delete(void * memory, std::size_t) noexcept
{
    std::free(memory);
}

namespace
{

constexpr int64_t PERIOD_NS = 2'000'000, START_NS = 1'700'000'000'000'000'000;
constexpr double TURN = 3.1415, AT[2] = {3.0, -7.0}, LIMIT[3] = {23.7, 23.7, 35.55};

void require(bool is_so, const char * what)
{
    if (!is_so) {
        std::fprintf(stderr, "not so: %s\n", what);
        std::exit(1);
    }
}

std::vector<std::string> names(const char * prefix, int count)
{
    std::vector<std::string> found;
    for (int i = 0; i < count; ++i) {
        found.push_back(prefix + std::to_string(i));
    }
    return found;
}

/// A plugin with the values that its interfaces are loaned of.
struct Robot
{
    std::shared_ptr<ControllerInterface> plugin = new_plugin();
    std::vector<Handle> commands, states;
    int64_t calls = 0;

    explicit Robot(const std::map<std::string, rclcpp::Value> & values = {})
    {
        auto & declared = plugin->get_node()->values;
        std::vector<std::string> feet;
        for (const std::string & foot : names("foot", 4)) {
            feet.push_back(foot + "/contact");
        }
        declared["feet"] = feet;
        declared["start"] = std::string("jump");
        for (const auto & [name, value] : values) {
            declared[name] = value;
        }
        require(plugin->on_init() == CallbackReturn::SUCCESS, "on_init");
    }

    CallbackReturn configure() { return plugin->on_configure({}); }

    CallbackReturn activate(bool in_order = true)
    {
        for (const std::string & name : plugin->command_interface_configuration().names) {
            commands.push_back({name, 99.0});
        }
        for (const std::string & name : plugin->state_interface_configuration().names) {
            states.push_back({name});
        }
        if (!in_order) {
            std::swap(states[0], states[1]);
        }
        std::vector<LoanedCommandInterface> loaned_commands;
        std::vector<LoanedStateInterface> loaned_states;
        for (Handle & handle : commands) {
            loaned_commands.emplace_back(handle);
        }
        for (const Handle & handle : states) {
            loaned_states.emplace_back(handle);
        }
        plugin->assign_interfaces(std::move(loaned_commands), std::move(loaned_states));
        return plugin->on_activate({});
    }

    /// Measures a sample of the jump.
    void measure(std::size_t k) { measure(JUMP_X[k], JUMP_DX[k], JUMP_FEET[k]); }

    /// Measures a state in a world that is turned and shifted.
    void measure(const double * x, const double * dx, const uint8_t * feet)
    {
        double values[41];
        for (int i = 0; i < 12; ++i) {
            values[2 * i] = x[i];
            values[2 * i + 1] = dx[i];
        }
        const double yaw = x[17] + TURN, sr = std::sin(x[15]), cr = std::cos(x[15]), sp = std::sin(x[16]), cp = std::cos(x[16]);
        const double hr = 0.5 * x[15], hp = 0.5 * x[16], hy = 0.5 * yaw;
        values[24] = std::sin(hr) * std::cos(hp) * std::cos(hy) - std::cos(hr) * std::sin(hp) * std::sin(hy);
        values[25] = std::cos(hr) * std::sin(hp) * std::cos(hy) + std::sin(hr) * std::cos(hp) * std::sin(hy);
        values[26] = std::cos(hr) * std::cos(hp) * std::sin(hy) - std::sin(hr) * std::sin(hp) * std::cos(hy);
        values[27] = std::cos(hr) * std::cos(hp) * std::cos(hy) + std::sin(hr) * std::sin(hp) * std::sin(hy);
        values[28] = dx[15] - dx[17] * sp;
        values[29] = dx[16] * cr + dx[17] * sr * cp;
        values[30] = -dx[16] * sr + dx[17] * cr * cp;
        const double c = std::cos(TURN), s = std::sin(TURN);
        values[31] = AT[0] + c * x[12] - s * x[13];
        values[32] = AT[1] + s * x[12] + c * x[13];
        values[33] = x[14];
        values[34] = c * dx[12] - s * dx[13];
        values[35] = s * dx[12] + c * dx[13];
        values[36] = dx[14];
        for (int foot = 0; foot < 4; ++foot) {
            values[37 + foot] = feet[foot];
        }
        for (std::size_t i = 0; i < states.size(); ++i) {
            states[i].value = values[i];
        }
    }

    return_type update()
    {
        // Calls are never quite on time.
        const int64_t late_ns = 1000 * (calls * 7919 % 100);
        const rclcpp::Time now(START_NS + calls++ * PERIOD_NS + late_ns);
        const long before = allocations;
        is_counted = true;
        const return_type result = plugin->update(now, rclcpp::Duration(PERIOD_NS));
        is_counted = false;
        require(allocations == before, "update allocates nothing");
        for (std::size_t i = 0; i < 12; ++i) {
            require(std::abs(commands[i].value) <= LIMIT[i % 3], "efforts are finite and within the limits");
        }
        return result;
    }

    /// Steps and fallbacks, as the plugin reports them on deactivation.
    std::pair<long, long> deactivate()
    {
        require(plugin->on_deactivate({}) == CallbackReturn::SUCCESS, "on_deactivate");
        for (const Handle & command : commands) {
            require(!(command.value < 0 || command.value > 0), "no effort after deactivation");
        }
        std::pair<long, long> found;
        require(std::sscanf(plugin->get_node()->last->c_str(), "%ld steps, %ld of", &found.first, &found.second) == 2,
                "a report");
        return found;
    }
};

}  // namespace

#endif
