/* Force and moment of torques, from a generated controller's own static function: its source is part of this program.
 * usage: wrench FILE; the file has runs of double x[18], torque[12], wrench[6]; uint8 feet[4], native byte order. Prints how
 * many there are and how many differ, and fails if any does. */
#include SOURCE

#include <stdio.h>

int main(int argc, char **argv)
{
    long count = 0, different = 0;
    double numbers[36], found[6];
    uint8_t feet[4];
    FILE *input = argc > 1 ? fopen(argv[1], "rb") : NULL;
    if (input == NULL) {
        return 2;
    }
    while (fread(numbers, sizeof numbers[0], 36, input) == 36 && fread(feet, 1, 4, input) == 4) {
        int same = wrench(numbers, numbers + 18, feet, found);
        for (int i = 0; i < 6; ++i) {
            /* A sum of nothing may have either sign. */
            same = same && !(found[i] < numbers[30 + i]) && !(found[i] > numbers[30 + i]);
        }
        if (!same && different < 3) {
            printf("sample %ld: %.17g %.17g not %.17g %.17g\n", count, found[0], found[5], numbers[30], numbers[35]);
        }
        different += !same;
        ++count;
    }
    fclose(input);
    printf("%ld samples, %ld different\n", count, different);
    return count == 0 || different > 0;
}
