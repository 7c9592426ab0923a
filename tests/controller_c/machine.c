/* Replays steps of the state machine from a file and compares every command, mode and answer with the file's, bit for
 * bit or up to a tolerance.
 * usage: machine FILE [TOLERANCE]; prints steps and differing ones. Native byte order: int64 samples; double time_s[samples], x[18 samples],
 * dx[18 samples], u[18 samples]; uint8 feet[4 samples]; then for each step int64 request (0 none, 1 stand, 2 jump, 3 damp, 4
 * reset, 5 prepare, 6 a new machine, 7 strides as its trajectory, 8 stop, 9 to 12 walk, 13 the strides again), its answer; double time_s, x[18], dx[18]; int64 feet, a bit each;
 * double torque[12], joint_position[12], joint_velocity[12], stiffness, damping, u_lat[D]; int64 status, mode. */
#include HEADER

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PASTE_(a, b) a##b
#define PASTE(a, b) PASTE_(a, b)
#define FN(suffix) PASTE(NAME, suffix)
#define D PASTE(UPPER, _LATENT_DIM)
#define MOST 2000
#ifdef WALKS
/* Commands: forwards and to the left, m/s, and yaw, rad/s; the last is none. */
static const double VELOCITIES[4][3] = {{0.5, 0, 0.3}, {0.8, 0.05, -0.4}, {9, -9, 9}, {0.5, NAN, 0}};
#endif

static int request_of(FN(_machine) *machine, int64_t request, double time_s, const double *x)
{
    switch (request) {
    case 1:
        return FN(_machine_stand)(machine, time_s, x);
    case 2:
        return FN(_machine_jump)(machine);
    case 3:
        FN(_machine_damp)(machine);
        return 0;
    case 4:
        FN(_machine_reset)(machine);
        return 0;
    case 5:
        FN(_machine_prepare)(machine, time_s);
        return 0;
#ifdef WALKS
    case 13:
        return FN(_machine_set_walk)(machine) == 0;
    case 8:
        return FN(_machine_stop)(machine);
    case 9:
    case 10:
    case 11:
    case 12:
        return FN(_machine_walk)(machine, VELOCITIES[request - 9][0], VELOCITIES[request - 9][1], VELOCITIES[request - 9][2]);
#endif
    default:
        return 0;
    }
}

/* Whether numbers are the same, or nearly where that is enough. */
static int agree(const double *found, const double *wanted, int count, double tolerance)
{
    for (int i = 0; i < count; ++i) {
        const double off = found[i] - wanted[i];
        if (memcmp(found + i, wanted + i, sizeof found[i]) != 0 && !(off < tolerance && off > -tolerance)) {
            return 0;
        }
    }
    return 1;
}

int main(int argc, char **argv)
{
    static FN(_machine) machine;
    static double time_s[MOST], x[18 * MOST], dx[18 * MOST], u[18 * MOST];
    static uint8_t feet[4 * MOST];
    long steps = 0, different = 0, modes[7] = {0};
    int64_t count = 0, asked[2];
    const double tolerance = argc > 2 ? atof(argv[2]) : 0;
    FILE *input = argc > 1 ? fopen(argv[1], "rb") : NULL;
    if (input == NULL || fread(&count, sizeof count, 1, input) != 1 || count > MOST) {
        return 2;
    }
    const size_t n = (size_t)count;
    if (fread(time_s, 8, n, input) != n || fread(x, 8, 18 * n, input) != 18 * n || fread(dx, 8, 18 * n, input) != 18 * n
        || fread(u, 8, 18 * n, input) != 18 * n || fread(feet, 1, 4 * n, input) != 4 * n) {
        return 2;
    }
    while (fread(asked, 8, 2, input) == 2) {
        double seen[37], wanted[38 + D];
        int64_t flags, codes[2];
        uint8_t down[4];
        FN(_command) command;
        if (fread(seen, 8, 37, input) != 37 || fread(&flags, 8, 1, input) != 1 || fread(wanted, 8, 38 + D, input) != 38 + D
            || fread(codes, 8, 2, input) != 2) {
            return 2;
        }
        for (int foot = 0; foot < 4; ++foot) {
            down[foot] = (flags >> foot) & 1;
        }
        if (asked[0] == 6) {
            if (FN(_machine_init)(&machine, NULL, NULL) != 0
                || FN(_controller_set_reference)(&machine.controller, n, time_s, x, dx, u, feet) != 0) {
                return 2;
            }
        }
#ifdef WALKS
        if (asked[0] == 7) {
            const FN(_controller_settings) settings = FN(_walk_settings)();
            if (FN(_machine_init)(&machine, &settings, NULL) != 0 || FN(_machine_set_walk)(&machine) != 0) {
                return 2;
            }
        }
#endif
        const int answer = request_of(&machine, asked[0], seen[0], seen + 1);
        FN(_machine_step)(&machine, seen[0], seen + 1, seen + 19, down, &command);
        const int mode = FN(_machine_mode)(&machine);
        const int same = answer == asked[1] && agree(command.torque, wanted, 12, tolerance)
            && agree(command.joint_position, wanted + 12, 12, tolerance)
            && agree(command.joint_velocity, wanted + 24, 12, tolerance)
            && agree(&command.stiffness, wanted + 36, 1, tolerance) && agree(&command.damping, wanted + 37, 1, tolerance)
            && agree(command.u_lat, wanted + 38, D, tolerance) && command.status == codes[0] && mode == codes[1];
        if (!same && different < 3) {
            printf("step %ld: answer %d not %d, mode %d not %d, status %d not %d, torque %.17g not %.17g\n", steps, answer,
                   (int)asked[1], mode, (int)codes[1], command.status, (int)codes[0], command.torque[0], wanted[0]);
        }
        different += !same;
        ++steps;
        ++modes[mode];
    }
    printf("%ld steps, %ld different; steps in each mode: %ld %ld %ld %ld %ld %ld %ld\n", steps, different, modes[0], modes[1],
           modes[2], modes[3], modes[4], modes[5], modes[6]);
    fclose(input);
    return different > 0 || steps == 0;
}
