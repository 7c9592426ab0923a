// Drives the generated plugin of ros2_control as a controller manager would, on stubs of ROS: along the jump of the
// generated header, in a world that is turned and shifted, with efforts beside those of the controller in C; with values
// that are not finite; and with parameters that are refused. usage: drive JUMP.csv
#include "driven.hpp"

#include <fstream>
#include <sstream>

namespace
{

constexpr std::size_t COUNT = sizeof JUMP_TIME_S / sizeof JUMP_TIME_S[0];
constexpr int CALLS = 5;

/// Efforts along the jump are those of the controller in C with a joint PD; the largest difference, N m.
double follow_jump(double effectiveness_time_s, double flight_torque, const std::string & lift = "plain")
{
    const double stiffness = 20, damping = 0.8;
    Robot robot({{"effectiveness_time_s", effectiveness_time_s}, {"flight_torque", flight_torque}, {"lift", lift}});
    require(robot.configure() == CallbackReturn::SUCCESS, "on_configure");
    require(robot.activate() == CallbackReturn::SUCCESS, "on_activate");
    static FN(_controller) beside;
    FN(_controller_settings) settings = FN(_controller_settings_default)();
    settings.lift = lift == "plain" ? PASTE(UPPER, _LIFT_TRANSPOSE) : PASTE(UPPER, _LIFT_CONSISTENT);
    settings.effectiveness_time_s = effectiveness_time_s;
    settings.flight_torque = flight_torque;
    settings.drive_stiffness_nm_rad = stiffness;
    settings.drive_damping_nm_s_rad = damping;
    require(FN(_controller_init)(&beside, &settings) == 0
                && FN(_controller_set_reference_torque)(&beside, COUNT, JUMP_TIME_S, JUMP_X[0], JUMP_DX[0], JUMP_TORQUE[0],
                                                       JUMP_FEET[0]) == 0,
            "the controller in C");
    double worst = 0;
    for (std::size_t k = 0; k < COUNT; ++k) {
        FN(_command) command;
        FN(_controller_step)(&beside, static_cast<double>(k) * settings.step_s, JUMP_X[k], JUMP_DX[k], JUMP_FEET[k], &command);
        robot.measure(k);
        for (int call = 0; call < CALLS; ++call) {
            require(robot.update() == return_type::OK, "update along the jump");
            for (std::size_t i = 0; i < 12; ++i) {
                double effort = command.torque[i] + stiffness * (command.joint_position[i] - JUMP_X[k][i])
                    + damping * (command.joint_velocity[i] - JUMP_DX[k][i]);
                effort = std::fmin(std::fmax(effort, -LIMIT[i % 3]), LIMIT[i % 3]);
                worst = std::fmax(worst, std::abs(effort - robot.commands[i].value));
            }
        }
    }
    const auto [steps, fallbacks] = robot.deactivate();
    require(steps == static_cast<long>(COUNT) && fallbacks == 0, "as many steps as samples, all with a plan");
    return worst;
}

/// A robot whose joints go where they are sent stands up, jumps along the recorded jump, and stands again.
void stand_jump_stand()
{
    Robot robot({{"start", std::string("stand")}, {"stand_s", 0.5}, {"settle_s", 0.1}});
    require(robot.configure() == CallbackReturn::SUCCESS && robot.activate() == CallbackReturn::SUCCESS, "activation");
    // Ready after 0.6 s and a step; then along the jump, at rest after its end, and back to its first posture in 0.5 s.
    constexpr std::size_t READY = 61, REST = 80, BACK = READY + COUNT + 12;
    for (std::size_t k = 0; k < READY + COUNT + REST; ++k) {
        robot.measure(k < READY ? 0 : k < READY + COUNT ? k - READY : COUNT - 1);
        for (std::size_t i = 0; i < 37 && (k < READY || k >= READY + COUNT); ++i) {
            const bool is_velocity = i < 24 ? i % 2 == 1 : i >= 28 && (i < 31 || i >= 34);
            robot.states[i].value = is_velocity ? 0.0 : robot.states[i].value;
        }
        const double passed = k < BACK ? 0 : std::fmin(static_cast<double>(k - BACK) / 50, 1), share = passed * passed * (3 - 2 * passed);
        for (std::size_t i = 0; i < 12 && k >= BACK; ++i) {
            robot.states[2 * i].value += share * (JUMP_X[0][i] - JUMP_X[COUNT - 1][i]);
        }
        for (int call = 0; call < CALLS; ++call) {
            require(robot.update() == return_type::OK, "update while the robot stands or jumps");
        }
    }
    const auto [steps, fallbacks] = robot.deactivate();
    require(steps == static_cast<long>(READY + COUNT + REST) && fallbacks == 0, "stands, jumps and stands without a fallback");
}

void survive_undefined_values()
{
    Robot robot({{"max_fallbacks", int64_t{6}}});
    require(robot.configure() == CallbackReturn::SUCCESS && robot.activate() == CallbackReturn::SUCCESS, "activation");
    robot.measure(0);
    robot.states[20].value = std::nan("");
    require(robot.update() == return_type::OK, "a first value that is undefined");
    require(!(robot.commands[0].value < 0 || robot.commands[0].value > 0), "no effort before a sound measurement");
    return_type waited = return_type::OK;
    for (int call = 0; call < 6 * CALLS + 1; ++call) {
        waited = robot.update();
    }
    require(waited == return_type::ERROR, "too long without a sound measurement");
    std::size_t k = 0;
    const auto run = [&](std::size_t samples, bool is_sound) {
        return_type last = return_type::OK;
        for (std::size_t end = k + samples; k < end; ++k) {
            robot.measure(k);
            if (!is_sound) {
                robot.states[3].value = std::nan("");
            }
            for (int call = 0; call < CALLS; ++call) {
                last = robot.update();
            }
        }
        return last;
    };
    require(run(10, true) == return_type::OK, "sound measurements");
    require(run(6, false) == return_type::OK, "a few fallbacks");
    require(run(1, false) == return_type::ERROR, "too many fallbacks in a row");
    require(run(10, true) == return_type::OK, "sound measurements again");
    robot.calls = 0;
    require(robot.update() == return_type::ERROR, "a clock that was set back");
    require(robot.deactivate().second == 7, "fallbacks are counted");
    require(robot.plugin->get_node()->last->find("not finite") != std::string::npos, "the last fallback is named");
}

/// An activation names the bounds of the supervisor that are off.
void name_bounds_off(const std::map<std::string, rclcpp::Value> & values, const std::string & names)
{
    Robot robot(values);
    require(robot.configure() == CallbackReturn::SUCCESS && robot.activate() == CallbackReturn::SUCCESS, "activation");
    require(*robot.plugin->get_node()->last == "bounds of the supervisor that are off: " + names, names.c_str());
}

void refuse()
{
    const auto faults = [](const char * name, const rclcpp::Value & value, const char * word) {
        Robot robot({{name, value}});
        require(robot.configure() == CallbackReturn::FAILURE, name);
        require(robot.plugin->get_node()->last->find(word) != std::string::npos, word);
    };
    faults("joints", names("joint", 11), "12 names");
    faults("feet", std::vector<std::string>{}, "4 full names");
    faults("plan_file", std::string("missing.csv"), "missing.csv: cannot be read");
    faults("plan_file", std::string(__FILE__), "no column");
    faults("effectiveness_time_s", -1.0, "effectiveness_time_s");
    faults("body_friction", std::nan(""), "body_friction");
    faults("flight_torque", 1.5, "flight_torque");
    faults("stiffness", -2.0, "stiffness");
    faults("torque_rate_nm_s", PASTE(UPPER, _TORQUE_RATES) ? -1.0 : 100.0, "torque_rate_nm_s");
    faults("start", std::string("now"), "start: stand or jump, not `now`");
    faults("stand_s", 0.0, "stand_s and settle_s: positive");
    faults("lift", std::string("Consistent"), "lift: plain or consistent, not `Consistent`");
    if (!PASTE(UPPER, _CONSISTENT_LIFT)) {
        faults("lift", std::string("consistent"), "lift: plain alone");
    }
    Robot robot;
    require(robot.configure() == CallbackReturn::SUCCESS, "on_configure");
    require(robot.activate(false) == CallbackReturn::ERROR, "interfaces in another order");
}

/// A plan whose second sample has another text in a column is refused by its place.
void refuse_cell(const std::string & path, const std::string & column, const std::string & cell, const char * words)
{
    std::ifstream file(path);
    std::string header, first, second;
    std::getline(file, header);
    std::getline(file, first);
    std::getline(file, second);
    std::stringstream names(header), values(second);
    std::string changed, value;
    for (std::string name; std::getline(names, name, ';') && std::getline(values, value, ';');) {
        changed += (name == column ? cell : value) + ";";
    }
    const std::string bad = path + ".bad.csv";
    std::ofstream(bad) << header << '\n' << first << '\n' << changed << '\n';
    Robot robot({{"plan_file", bad}});
    require(robot.configure() == CallbackReturn::FAILURE, words);
    const std::string & said = *robot.plugin->get_node()->last;
    const std::string place = bad + ": line 3, column `" + column + "`: found ";
    if (said.find(place) == std::string::npos || said.find(words) == std::string::npos) {
        std::fprintf(stderr, "%s\n", said.c_str());
        require(false, words);
    }
}

void refuse_implausible(const std::string & path)
{
    refuse_cell(path, "Time", "2,0", "2 s after 0 s, expected a step of 0.0001 s to that of the controller, 0.010101 s");
    refuse_cell(path, "Time", "0,0", "0 s after 0 s");
    refuse_cell(path, "Time", "inf", "`inf`, expected a finite number");
    refuse_cell(path, "fr Foot", "0,4", "0.4, expected contact 0 or 1");
    refuse_cell(path, "fl.kn Position", "-80,0", "-80, expected");
    refuse_cell(path, "Body angular Position y", "3,0", "3, expected -1.5708 to 1.5708");
    refuse_cell(path, "Body linear Position z", "300,0", "expected less than 10 m/s");
    refuse_cell(path, "rl.hx Torque", "nan", "`nan`, expected a finite number");
}

void load(const std::string & path)
{
    Robot robot({{"plan_file", path}});
    require(robot.configure() == CallbackReturn::SUCCESS, robot.plugin->get_node()->last->c_str());
    require(robot.activate() == CallbackReturn::SUCCESS, "on_activate with a plan from a file");
    for (std::size_t k = 0; k < COUNT; ++k) {
        robot.measure(k);
        for (int call = 0; call < CALLS; ++call) {
            require(robot.update() == return_type::OK, "update along a plan from a file");
        }
    }
    require(robot.deactivate().second == 0, "no fallback along a plan from a file");
}

}  // namespace

int main(int argc, char ** argv)
{
    const double trusting = follow_jump(0, 0), estimating = follow_jump(1, 0.5);
    std::printf("efforts within %.1e and, with the estimate, %.1e N m\n", trusting, estimating);
    require(trusting < 1e-6 && estimating < 1e-6, "efforts are those of the controller in C");
    if (PASTE(UPPER, _CONSISTENT_LIFT)) {
        const double consistent = follow_jump(0, 1, "consistent");
        std::printf("efforts of the consistent lift within %.1e N m\n", consistent);
        require(consistent < 1e-6, "efforts are those of the controller in C with the consistent lift");
    }
    stand_jump_stand();
    survive_undefined_values();
    name_bounds_off({}, "none");
    name_bounds_off({{"tilt_rad", HUGE_VAL}, {"poor_steps", 0.0}}, "tilt_rad poor_steps");
    refuse();
    require(argc > 1, "a jump in a file");
    load(argv[1]);
    refuse_implausible(argv[1]);
    return 0;
}
