/* What Eva analyses: the state machine around a controller of two latent coordinates with five stages, a reference of three
 * samples, steps in every mode. Ranges: states -4 to 4 (m, rad), velocities -40 to 40, inputs -1000 to 1000, times 0 to 1 s,
 * any feet. */
#include "go1_d2_controller.h"

#include "__fc_builtin.h"

#define COUNT 3

static double time_s[COUNT] = {0.0, 0.01, 0.02}, x[COUNT * 18], dx[COUNT * 18], u[COUNT * 18];
static uint8_t feet[COUNT * 4];
static go1_d2_machine machine;

static void fill(double *values, int count, double limit)
{
    for (int i = 0; i < count; ++i) {
        values[i] = Frama_C_double_interval(-limit, limit);
    }
}

int main(void)
{
    go1_d2_command command;
    go1_d2_controller_settings settings = go1_d2_controller_settings_default();
    double now_x[18], now_dx[18];
    uint8_t now_feet[4];
    fill(x, COUNT * 18, 4.0);
    fill(dx, COUNT * 18, 40.0);
    fill(u, COUNT * 18, 1000.0);
    for (int i = 0; i < COUNT * 4; ++i) {
        feet[i] = (uint8_t)Frama_C_interval(0, 1);
    }
    settings.effectiveness_time_s = 1.0;
    settings.drive_stiffness_nm_rad = 20.0;
    settings.drive_damping_nm_s_rad = 0.8;
    go1_d2_controller_bound_off(Frama_C_interval(0, 1) ? &settings : 0, Frama_C_interval(-2147483647, 2147483647));
    if (go1_d2_machine_init(&machine, &settings, 0) != 0
        || go1_d2_controller_set_reference(&machine.controller, COUNT, time_s, x, dx, u, feet) != 0) {
        return 1;
    }
    /* What a reference that was taken has set already: Eva joins that state with those of refused ones. */
    const go1_d2_reference taken = {COUNT, time_s, x, dx, u, 0, feet};
    machine.controller.reference = taken;
    machine.controller.has_reference = 1;
    for (int k = 0; k < 2; ++k) {
        fill(now_x, 18, 4.0);
        fill(now_dx, 18, 40.0);
        for (int i = 0; i < 4; ++i) {
            now_feet[i] = (uint8_t)Frama_C_interval(0, 1);
        }
        machine.routine.mode = (go1_d2_online_mode)Frama_C_interval(0, 5);
        go1_d2_machine_stand(&machine, Frama_C_double_interval(0.0, 1.0), now_x);
        go1_d2_machine_jump(&machine);
        go1_d2_machine_step(&machine, Frama_C_double_interval(0.0, 1.0), now_x, now_dx, now_feet, &command);
    }
    return 0;
}
