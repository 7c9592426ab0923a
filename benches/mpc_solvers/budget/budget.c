/* Budgets of a generated controller. usage: budget STAGES IS_PUSHED STEPS LIFT; prints the bytes of its struct, the bytes of
 * stack that a step took, and the iterations of all steps; `run.sh` beside it counts instructions. */
#include HEADER
#include JUMP

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PASTE_(a, b) a##b
#define PASTE(a, b) PASTE_(a, b)
#define FN(suffix) PASTE(NAME, suffix)
#define COUNT (int)(sizeof JUMP_TIME_S / sizeof JUMP_TIME_S[0])
#define PAINTED 32768

static FN(_controller) controller;
static FN(_command) command;

/* Paints the memory below the caller's stack, or counts the bytes of it that are no longer painted. */
__attribute__((noinline)) static int stack(int is_painting)
{
    volatile unsigned char below[PAINTED];
    int untouched = 0;
    if (is_painting) {
        for (int i = 0; i < PAINTED; ++i) {
            below[i] = 0xa5;
        }
        return 0;
    }
    while (untouched < PAINTED && below[untouched] == 0xa5) {
        ++untouched;
    }
    return PAINTED - untouched;
}

int main(int argc, char **argv)
{
    const int horizon = argc > 1 ? atoi(argv[1]) : 20, is_pushed = argc > 2 && atoi(argv[2]);
    const int steps = argc > 3 ? atoi(argv[3]) : 40;
    const int lift = argc > 4 ? atoi(argv[4]) : 0;
    int deepest = 0;
    long iterations = 0;
    FN(_controller_settings) settings = FN(_controller_settings_default)();
    settings.horizon = horizon;
    settings.lift = lift;
    if (FN(_controller_init)(&controller, &settings) != 0
        || FN(_controller_set_reference_torque)(&controller, COUNT, JUMP_TIME_S, JUMP_X[0], JUMP_DX[0], JUMP_TORQUE[0],
                                                JUMP_FEET[0]) != 0) {
        return 1;
    }
    for (int k = 0; k < steps; ++k) {
        REAL x[18], dx[18];
        memcpy(x, JUMP_X[k], sizeof x);
        memcpy(dx, JUMP_DX[k], sizeof dx);
        if (is_pushed) {
            const int push = k / 8 % 5 - 2;
            x[14] += (REAL)(0.08 * push);
            x[16] += (REAL)(0.25 * push);
            dx[14] += (REAL)(1.5 * push);
        }
        stack(1);
        FN(_controller_step)(&controller, JUMP_TIME_S[k], x, dx, JUMP_FEET[k], &command);
        const int used = stack(0);
        deepest = used > deepest ? used : deepest;
        iterations += command.iterations;
    }
    printf("%d bytes, %d of stack, %ld iterations\n", (int)sizeof controller, deepest, iterations);
    return 0;
}
