/* Consistent lifts of a generated controller's own static function: its source is part of this program.
 * usage: lift FILE; the file has runs of double joints[12], attitude[3], u_lat[D], losses[12], torque[12]; uint8 feet[4],
 * phase, is_lifted, native byte order. Prints how many there are and how many differ, and fails if any does. */
#include SOURCE

#include <stdio.h>

#define PASTE_(a, b) a##b
#define PASTE(a, b) PASTE_(a, b)

int main(int argc, char **argv)
{
    static PASTE(NAME, _controller) c;
    long count = 0, different = 0;
    double numbers[39 + D], found[12];
    uint8_t flags[6];
    FILE *input = argc > 1 ? fopen(argv[1], "rb") : NULL;
    if (input == NULL || PASTE(NAME, _controller_init)(&c, NULL) != 0) {
        return 2;
    }
    while (fread(numbers, sizeof numbers[0], 39 + D, input) == 39 + D && fread(flags, 1, 6, input) == 6) {
        const double *u_lat = numbers + 15, *losses = u_lat + D, *wanted = losses + 12;
        memcpy(c.stance_joints, numbers, sizeof c.stance_joints);
        memcpy(c.stance_attitude, numbers + 12, sizeof c.stance_attitude);
        memcpy(c.stance_feet, flags, sizeof c.stance_feet);
        c.plan.phase = flags[4];
        const int is_lifted = lift(&c, u_lat, losses, found);
        const int same = is_lifted == flags[5] && (!is_lifted || memcmp(found, wanted, sizeof found) == 0);
        if (!same && different < 3) {
            printf("sample %ld: %d not %d, %.17g not %.17g\n", count, is_lifted, flags[5], found[0], wanted[0]);
        }
        different += !same;
        ++count;
    }
    fclose(input);
    printf("%ld samples, %ld different\n", count, different);
    return count == 0 || different > 0;
}
