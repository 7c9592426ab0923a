/* Settings that a generated controller refuses: each is named, and init returns its code. */
#include HEADER

#include <math.h>
#include <stdio.h>
#include <string.h>

#define PASTE_(a, b) a##b
#define PASTE(a, b) PASTE_(a, b)
#define FN(suffix) PASTE(NAME, suffix)

static int faults;

static void expect(FN(_controller_settings) settings, const char *name)
{
    static FN(_controller) controller;
    const char *found = FN(_controller_refused_setting)(&settings);
    const int code = FN(_controller_init)(&controller, &settings);
    const int is_right = name == NULL ? found == NULL && code == 0
                                      : found != NULL && strncmp(found, name, strlen(name)) == 0
                                            && code == PASTE(UPPER, _BAD_SETTING);
    if (!is_right) {
        printf("%s: found %s, code %d\n", name ? name : "none", found ? found : "none", code);
        ++faults;
    }
}

#define TRY(field, value)                                                                                              \
    do {                                                                                                               \
        FN(_controller_settings) changed = FN(_controller_settings_default)();                                         \
        changed.field = (value);                                                                                       \
        expect(changed, #field);                                                                                       \
    } while (0)

int main(void)
{
    FN(_controller_settings) settings = FN(_controller_settings_default)();
    expect(settings, NULL);
    TRY(horizon, 0);
    TRY(horizon, PASTE(UPPER, _MAX_HORIZON) + 1);
    TRY(max_iterations, 0);
    TRY(lift, 2);
    TRY(lift, -1);
    TRY(foot_friction, 0);
    TRY(lift_prior_weight, (double)NAN);
    TRY(linearisation, 2);
    TRY(step_s, (double)NAN);
    TRY(input_weight, 0);
    TRY(velocity_weight, -1);
    TRY(terminal_weight, (double)INFINITY);
    TRY(joint_penalty, 0);
    TRY(body_friction, -0.5);
    TRY(swing_turn, -0.1);
    TRY(legs, 2);
    TRY(place_scale_m, -0.1);
    TRY(heading_scale_rad, (double)NAN);
    TRY(flight_torque, -0.1);
    TRY(flight_torque, 1.1);
    TRY(flight_torque, (double)NAN);
    TRY(torque_rate_nm_s, -1);
    TRY(torque_rate_nm_s, (double)NAN);
    settings.torque_rate_nm_s = 100;
    expect(settings, PASTE(UPPER, _TORQUE_RATES) ? NULL : "torque_rate_nm_s");
    settings.torque_rate_nm_s = 0;
    TRY(effectiveness_time_s, -1);
    TRY(effectiveness_time_s, (double)NAN);
    settings.effectiveness_time_s = 1;
    expect(settings, NULL);
    settings.drive_stiffness_nm_rad = -1;
    expect(settings, "drive_stiffness_nm_rad");
    settings.drive_stiffness_nm_rad = 20;
    settings.drive_damping_nm_s_rad = (double)NAN;
    expect(settings, "drive_damping_nm_s_rad");
    TRY(tilt_rad, 0);
    TRY(tilt_rad, (double)NAN);
    TRY(clock_gap_s, -1);
    TRY(frozen_steps, -1);
    TRY(fade_s, 0);
    TRY(after_end, 3);
    settings = FN(_controller_settings_default)();
    settings.tilt_rad = settings.clock_gap_s = (double)INFINITY;
    settings.poor_steps = 0;
    expect(settings, NULL);
    static const char *const OFF[] = {"tilt_rad", "clock_gap_s", "poor_steps", NULL};
    for (int i = 0; i < 4; ++i) {
        const char *found = FN(_controller_bound_off)(&settings, i);
        if (OFF[i] == NULL ? found != NULL : found == NULL || strcmp(found, OFF[i]) != 0) {
            printf("off: found %s\n", found ? found : "none");
            ++faults;
        }
    }
    if (FN(_controller_bound_off)(NULL, 0) != NULL || FN(_controller_bound_off)(&settings, -1) != NULL) {
        printf("off by default\n");
        ++faults;
    }
    return faults > 0;
}
