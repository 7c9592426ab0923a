/* Replays steps of the state machine from a file and compares every command, mode and answer with the file's, bit for bit.
 * usage: machine FILE; prints steps and differing ones. Native byte order: int64 samples; double time_s[samples], x[18 samples],
 * dx[18 samples], u[18 samples]; uint8 feet[4 samples]; then for each step int64 request (0 none, 1 stand, 2 jump, 3 damp, 4
 * reset, 5 prepare, 6 a new machine), its answer; double time_s, x[18], dx[18]; int64 feet, a bit each;
 * double torque[12], joint_position[12], joint_velocity[12], stiffness, damping, u_lat[D]; int64 status, mode. */
#include HEADER

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PASTE_(a, b) a##b
#define PASTE(a, b) PASTE_(a, b)
#define FN(suffix) PASTE(NAME, suffix)
#define D PASTE(UPPER, _LATENT_DIM)
#define MOST 2000

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
    default:
        return 0;
    }
}

int main(int argc, char **argv)
{
    static FN(_machine) machine;
    static double time_s[MOST], x[18 * MOST], dx[18 * MOST], u[18 * MOST];
    static uint8_t feet[4 * MOST];
    long steps = 0, different = 0, modes[6] = {0};
    int64_t count = 0, asked[2];
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
        const int answer = request_of(&machine, asked[0], seen[0], seen + 1);
        FN(_machine_step)(&machine, seen[0], seen + 1, seen + 19, down, &command);
        const int mode = FN(_machine_mode)(&machine);
        const int same = answer == asked[1] && memcmp(command.torque, wanted, sizeof command.torque) == 0
            && memcmp(command.joint_position, wanted + 12, sizeof command.joint_position) == 0
            && memcmp(command.joint_velocity, wanted + 24, sizeof command.joint_velocity) == 0
            && memcmp(&command.stiffness, wanted + 36, sizeof wanted[0]) == 0
            && memcmp(&command.damping, wanted + 37, sizeof wanted[0]) == 0
            && memcmp(command.u_lat, wanted + 38, sizeof command.u_lat) == 0 && command.status == codes[0] && mode == codes[1];
        if (!same && different < 3) {
            printf("step %ld: answer %d not %d, mode %d not %d, status %d not %d, torque %.17g not %.17g\n", steps, answer,
                   (int)asked[1], mode, (int)codes[1], command.status, (int)codes[0], command.torque[0], wanted[0]);
        }
        different += !same;
        ++steps;
        ++modes[mode];
    }
    printf("%ld steps, %ld different; steps in each mode: %ld %ld %ld %ld %ld %ld\n", steps, different, modes[0], modes[1],
           modes[2], modes[3], modes[4], modes[5]);
    fclose(input);
    return different > 0 || steps == 0;
}
