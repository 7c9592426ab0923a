/* Replays steps from a file through a generated controller and compares every command with the file's, bit for bit.
 * usage: replay FILE; prints steps, differing ones, the most iterations, torques beyond their limits, and how many steps had
 * a plan, a refused measurement, a latched fault. Native byte order:
 * runs until the end of the file, each of
 *   int64 samples, steps, has_u, is_next, lift, linearisation, after_end; double body_friction, effectiveness_time_s, stiffness and
 *   damping of the drives, foot_friction, lift_prior_weight, torque_rate_nm_s, swing_turn, flight_torque, is_watched,
 *   legs, place_scale_m, heading_scale_rad;
 *   double time_s[samples], x[18 samples], dx[18 samples], u[18 samples] if has_u; uint8 feet[4 samples]
 *   and for each step double time_s, x[18], dx[18]; uint8 feet[4], flags (1 prepare, 2 reset); double torque[12],
 *   joint_position[12], joint_velocity[12], stiffness, damping, u_lat[D]; int64 status, iterations. */
#include HEADER

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PASTE_(a, b) a##b
#define PASTE(a, b) PASTE_(a, b)
#define FN(suffix) PASTE(NAME, suffix)
#define D PASTE(UPPER, _LATENT_DIM)

static FILE *input;

static int get(void *to, size_t size, size_t count)
{
    return fread(to, size, count, input) == count;
}

static void need(void *to, size_t size, size_t count)
{
    if (!get(to, size, count)) {
        fprintf(stderr, "the file ends too early\n");
        exit(2);
    }
}

static void *array(size_t size, size_t count)
{
    void *values = malloc(size * count);
    if (values == NULL) {
        exit(2);
    }
    need(values, size, count);
    return values;
}

int main(int argc, char **argv)
{
    static const double LIMITS[3] = {23.7, 23.7, 35.55};
    static FN(_controller) controller;
    long steps = 0, different = 0, iterations = 0, beyond = 0, active = 0, fallbacks = 0, kinds = 0;
    long plans = 0, doubted = 0, damped = 0;
    unsigned long seen = 0;
    int64_t head[7];
    input = argc > 1 ? fopen(argv[1], "rb") : NULL;
    if (input == NULL) {
        return 2;
    }
    while (get(head, sizeof head[0], 7)) {
        const size_t count = (size_t)head[0];
        double chosen[13];
        need(chosen, sizeof chosen[0], 13);
        double *time_s = array(sizeof(double), count), *x = array(sizeof(double), 18 * count);
        double *dx = array(sizeof(double), 18 * count), *u = NULL;
        if (head[2]) {
            u = array(sizeof(double), 18 * count);
        }
        uint8_t *feet = array(1, 4 * count);
        FN(_controller_settings) settings = FN(_controller_settings_default)();
        settings.body_friction = chosen[0];
        settings.effectiveness_time_s = chosen[1];
        settings.drive_stiffness_nm_rad = chosen[2];
        settings.drive_damping_nm_s_rad = chosen[3];
        settings.foot_friction = chosen[4];
        settings.lift_prior_weight = chosen[5];
        settings.torque_rate_nm_s = chosen[6];
        settings.swing_turn = chosen[7];
        settings.flight_torque = chosen[8];
        settings.legs = (int32_t)chosen[10];
        settings.place_scale_m = chosen[11];
        settings.heading_scale_rad = chosen[12];
        settings.lift = (int32_t)head[4];
        settings.linearisation = (int32_t)head[5];
        settings.after_end = (int32_t)head[6];
        if (!(chosen[9] > 0)) {
            settings.tilt_rad = settings.joint_margin_rad = settings.joint_velocity = settings.distance_m = INFINITY;
            settings.posture_rad = settings.clock_gap_s = settings.velocity_mismatch = INFINITY;
            settings.frozen_steps = settings.contact_mismatch_steps = settings.poor_steps = 0;
        }
        const int is_next = head[3] != 0;
        if ((!is_next && FN(_controller_init)(&controller, &settings) != 0)
            || FN(_controller_set_reference)(&controller, count, time_s, x, dx, u, feet) != 0) {
            fprintf(stderr, "refused\n");
            return 2;
        }
        for (int64_t k = 0; k < head[1]; ++k) {
            double measured[37], wanted[38 + D];
            uint8_t flags[5];
            int64_t codes[2];
            FN(_command) command;
            need(measured, sizeof measured[0], 37);
            need(flags, 1, 5);
            need(wanted, sizeof wanted[0], 38 + D);
            need(codes, sizeof codes[0], 2);
            if (flags[4] & 2) {
                FN(_controller_reset)(&controller);
            }
            if (flags[4] & 1) {
                FN(_controller_prepare)(&controller, measured[0]);
            }
            FN(_controller_step)(&controller, measured[0], measured + 1, measured + 19, flags, &command);
            const int same = memcmp(command.torque, wanted, sizeof command.torque) == 0
                && memcmp(command.joint_position, wanted + 12, sizeof command.joint_position) == 0
                && memcmp(command.joint_velocity, wanted + 24, sizeof command.joint_velocity) == 0
                && memcmp(&command.stiffness, wanted + 36, sizeof wanted[0]) == 0
                && memcmp(&command.damping, wanted + 37, sizeof wanted[0]) == 0
                && memcmp(command.u_lat, wanted + 38, sizeof command.u_lat) == 0
                && command.status == codes[0] && command.iterations == codes[1];
            if (!same && different < 3) {
                printf("step %ld: status %d not %d, iterations %d not %d, torque %.17g not %.17g\n", steps, command.status,
                       (int)codes[0], command.iterations, (int)codes[1], command.torque[0], wanted[0]);
            }
            different += !same;
            ++steps;
            active += command.iterations > 0;
            plans += command.status >= 0 && command.status < 10;
            doubted += command.status == PASTE(UPPER, _MEASUREMENT_JUMP);
            damped += command.status >= 20;
            if (command.status >= 20) {
                seen |= 1ul << (command.status - 20);
            }
            fallbacks += command.status < 0 || command.status >= 10;
            iterations = command.iterations > iterations ? command.iterations : iterations;
            for (int i = 0; i < 12; ++i) {
                const double torque = command.torque[i] < 0 ? -command.torque[i] : command.torque[i];
                beyond += !(torque <= LIMITS[i % 3]);
            }
        }
        free(time_s);
        free(x);
        free(dx);
        free(u);
        free(feet);
    }
    for (; seen > 0; seen &= seen - 1) {
        ++kinds;
    }
    printf("%ld steps, %ld different, %ld with iterations, at most %ld, %ld fallbacks, %ld torques beyond their limit; "
           "%ld plans, %ld refused, %ld damped, %ld kinds of faults\n", steps, different, active, iterations, fallbacks, beyond,
           plans, doubted, damped, kinds);
    fclose(input);
    return different > 0 || beyond > 0 || steps == 0;
}
