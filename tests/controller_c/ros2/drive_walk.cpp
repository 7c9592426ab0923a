// Drives the generated plugin of ros2_control of a model of walks by velocities on its topic, on stubs of ROS, with efforts
// beside those of the state machine in C. usage: drive
#include "driven.hpp"

#include <array>

namespace
{

/// A robot whose joints go where they are sent, and whose body moves as commanded, under the state machine in C.
struct Walker
{
    FN(_machine) machine{};
    FN(_command) command{};
    double x[18] = {0}, dx[18] = {0}, now[3] = {0};
    uint8_t feet[4] = {1, 1, 1, 1};

    void move(const std::array<double, 3> & velocity)
    {
        constexpr double STEP_S = 0.002;
        for (int i = 0; i < 12; ++i) {
            dx[i] = (command.joint_position[i] - x[i]) / STEP_S;
            x[i] = command.joint_position[i];
        }
        for (std::size_t i = 0; i < 3; ++i) {
            now[i] += std::fmin(std::fmax(velocity[i] - now[i], -0.001), 0.001);
        }
        dx[12] = std::cos(x[17]) * now[0] - std::sin(x[17]) * now[1];
        dx[13] = std::sin(x[17]) * now[0] + std::cos(x[17]) * now[1];
        dx[17] = now[2];
        for (int i = 12; i < 18; ++i) {
            x[i] += STEP_S * dx[i];
        }
    }
};

/// Efforts of a walk by commands on the topic are those of the state machine in C with the requests that they stand for: a
/// start, another velocity, a stop because no command comes, another start, and a stop by zero. The largest difference.
double walk_by_commands()
{
    const std::map<std::string, double> off = {
        {"tilt_rad", HUGE_VAL}, {"distance_m", HUGE_VAL}, {"posture_rad", HUGE_VAL}, {"joint_velocity", HUGE_VAL},
        {"velocity_mismatch", HUGE_VAL}, {"joint_margin_rad", HUGE_VAL}, {"contact_mismatch_steps", 0}, {"poor_steps", 0},
        {"frozen_steps", 0}, {"stand_s", 0.5}, {"settle_s", 0.1}};
    std::map<std::string, rclcpp::Value> values(off.begin(), off.end());
    values["start"] = std::string("walk");
    Robot robot(values);
    require(robot.configure() == CallbackReturn::SUCCESS && robot.activate() == CallbackReturn::SUCCESS, "activation");
    const auto topic = std::static_pointer_cast<rclcpp::Subscription<geometry_msgs::msg::Twist>>(
        robot.plugin->get_node()->subscription.lock());
    require(topic != nullptr && topic->topic == "~/cmd_vel", "a topic of velocities");

    static Walker beside;
    FN(_controller_settings) settings = FN(_walk_settings)();
    settings.tilt_rad = settings.distance_m = settings.posture_rad = settings.joint_velocity = HUGE_VAL;
    settings.velocity_mismatch = settings.joint_margin_rad = HUGE_VAL;
    settings.contact_mismatch_steps = settings.poor_steps = settings.frozen_steps = 0;
    const FN(_timing) timing = {0.5, 0.1, 2.0};
    require(FN(_machine_init)(&beside.machine, &settings, &timing) == 0 && FN(_machine_set_walk)(&beside.machine) == 0,
            "the state machine in C");
    for (int i = 0; i < 12; ++i) {
        beside.x[i] = JUMP_X[0][i];
    }
    beside.x[14] = 0.27;
    require(FN(_machine_stand)(&beside.machine, 0, beside.x) == 1, "stands up");

    // Seconds: commands every 0.1 s to 2, others to 3, none to 5.5, then again to 6.5, then zero.
    const auto wanted = [](double time_s) -> std::array<double, 3> {
        return time_s < 0.9 || (time_s >= 3.45 && time_s < 5.45) || time_s >= 6.5 ? std::array<double, 3>{}
             : time_s < 2 ? std::array<double, 3>{0.4, 0, 0.2} : std::array<double, 3>{0.6, 0.05, -0.2};
    };
    std::array<double, 3> asked{};
    double worst = 0;
    bool has_stood = false;
    int starts = 0, last_mode = PASTE(UPPER, _MODE_DAMP);
    for (int64_t k = 0; k < 5000; ++k) {
        const double time_s = static_cast<double>(k) * 0.002;
        const bool is_silent = time_s < 0.9 || (time_s >= 3 && time_s < 5.45);
        if (k % 50 == 0 && !is_silent) {
            const auto [forward, left, turn] = wanted(time_s);
            geometry_msgs::msg::Twist twist;
            twist.linear.x = forward;
            twist.linear.y = left;
            twist.angular.z = turn;
            topic->callback(twist);
            twist.linear.x = std::nan("");
            topic->callback(twist);
            require(robot.plugin->get_node()->last->find("not finite") != std::string::npos, "an undefined velocity is named");
        }
        const bool is_walk = FN(_machine_mode)(&beside.machine) == PASTE(UPPER, _MODE_WALK);
        const bool is_ready = FN(_machine_mode)(&beside.machine) == PASTE(UPPER, _MODE_READY);
        // The last command of 2.9 s holds up to 3.4 s.
        const auto now = time_s > 3.4 && time_s < 5.5 ? std::array<double, 3>{} : wanted(static_cast<double>(k / 50 * 50) * 0.002);
        const bool moves = now[0] > 0;
        if (moves && (is_ready || (is_walk && now != asked))) {
            asked = FN(_machine_walk)(&beside.machine, now[0], now[1], now[2]) ? now : std::array<double, 3>{};
        } else if (!moves && asked[0] > 0) {
            require(FN(_machine_stop)(&beside.machine) == 1, "a stop");
            asked = {};
        }
        if (k > 0) {
            beside.move(is_walk ? asked : std::array<double, 3>{});
        }
        FN(_machine_step)(&beside.machine, time_s, beside.x, beside.dx, beside.feet, &beside.command);
        robot.measure(beside.x, beside.dx, beside.feet);
        require(robot.update() == return_type::OK, "update during a walk");
        for (std::size_t i = 0; i < 12; ++i) {
            const FN(_command) & command = beside.command;
            double effort = command.torque[i] + command.stiffness * (command.joint_position[i] - beside.x[i])
                + command.damping * (command.joint_velocity[i] - beside.dx[i]);
            effort = std::fmin(std::fmax(effort, -LIMIT[i % 3]), LIMIT[i % 3]);
            worst = std::fmax(worst, std::abs(effort - robot.commands[i].value));
        }
        const int mode = FN(_machine_mode)(&beside.machine);
        starts += mode == PASTE(UPPER, _MODE_WALK) && last_mode != mode;
        has_stood = has_stood || (starts == 1 && mode == PASTE(UPPER, _MODE_READY));
        last_mode = mode;
    }
    require(starts == 2 && has_stood && last_mode == PASTE(UPPER, _MODE_READY), "two walks, each with a stand after it");
    require(robot.deactivate().first == 5000, "a command every 2 ms");
    return worst;
}

}  // namespace

int main()
{
    const double walked = walk_by_commands();
    std::printf("efforts of a walk within %.1e N m\n", walked);
    require(walked < 1e-4, "efforts are those of the state machine in C");
    return 0;
}
