/* Counts of the steps of a generated controller. For each step it prints a line with its call (prepared, lift), its
 * status, its iterations, instructions and bytes of stack. `run.py` compiles it with a controller in which `is_endless`
 * disables the solver's tolerance, so that an extra first step and every twentieth run into the cap. On an emulated
 * processor whose clock counts its instructions the program reads that clock; elsewhere callgrind counts calls of
 * `counted`. */
#include HEADER
#include JUMP

#include <stdio.h>
#include <string.h>

#define PASTE_(a, b) a##b
#define PASTE(a, b) PASTE_(a, b)
#define FN(suffix) PASTE(NAME, suffix)
#define COUNT (int)(sizeof JUMP_TIME_S / sizeof JUMP_TIME_S[0])
#define PAINTED 32768

int is_endless;
static FN(_controller) controller;
static FN(_command) command;

#if defined(__ARM_ARCH_7EM__)
/* The clock of 25 MHz counts down; an instruction is 1 ns. */
static unsigned now(void)
{
    volatile unsigned *const timer = (unsigned *)0xE000E010;
    timer[1] = 0xffffff;
    timer[0] = 5;
    return timer[2];
}
static long passed(unsigned from, unsigned to) { return 40L * (long)((from - to) & 0xffffff); }
static void put(const char *text) { fputs(text, stdout); }
#elif defined(BARE)
/* The clock has 62.5 MHz. */
unsigned long semihosting(unsigned long operation, const void *argument);
static unsigned now(void)
{
    unsigned long ticks;
    __asm__ volatile("isb\n mrs %0, cntvct_el0" : "=r"(ticks));
    return (unsigned)ticks;
}
static long passed(unsigned from, unsigned to) { return 16L * (long)(to - from); }
static void put(const char *text) { semihosting(4, text); }
#else
static unsigned now(void) { return 0; }
static long passed(unsigned from, unsigned to) { return (long)(to - from); }
static void put(const char *text) { fputs(text, stdout); }
#endif

static void put_number(long number, char end)
{
    char text[24], *at = text + sizeof text - 2;
    const int is_negative = number < 0;
    unsigned long left = is_negative ? 0ul - (unsigned long)number : (unsigned long)number;
    at[0] = end;
    at[1] = 0;
    do {
        *--at = (char)('0' + left % 10);
        left /= 10;
    } while (left > 0);
    if (is_negative) {
        *--at = '-';
    }
    put(at);
}

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

__attribute__((noinline)) void counted(int k, const REAL *x, const REAL *dx)
{
    FN(_controller_step)(&controller, JUMP_TIME_S[k], x, dx, JUMP_FEET[k], &command);
}

static int run(int is_prepared, int lift)
{
    FN(_controller_settings) settings = FN(_controller_settings_default)();
    settings.lift = lift;
    /* The supervisor compares, and lets pushes and misses pass. */
    settings.poor_steps = 0;
    settings.contact_mismatch_steps = 1000000;
    settings.tilt_rad = 3;
    settings.joint_margin_rad = settings.distance_m = settings.posture_rad = settings.velocity_mismatch = 1000;
    if (FN(_controller_init)(&controller, &settings) != 0
        || FN(_controller_set_reference_torque)(&controller, COUNT, JUMP_TIME_S, JUMP_X[0], JUMP_DX[0], JUMP_TORQUE[0],
                                                JUMP_FEET[0]) != 0) {
        return 1;
    }
    for (int step = -1; step < COUNT; ++step) {
        const int k = step < 0 ? 0 : step;
        const REAL push = (REAL)(k / 8 % 5 - 2);
        REAL x[18], dx[18];
        memcpy(x, JUMP_X[k], sizeof x);
        memcpy(dx, JUMP_DX[k], sizeof dx);
        x[14] += (REAL)0.05 * push;
        x[16] += (REAL)0.15 * push;
        dx[14] += (REAL)0.9 * push;
        if (is_prepared) {
            FN(_controller_prepare)(&controller, JUMP_TIME_S[k]);
        }
        is_endless = lift == 0 && (step < 0 || k % 20 == 9);
        stack(1);
        const unsigned from = now();
        counted(k, x, dx);
        const long took = passed(from, now());
        put_number(is_prepared, ' ');
        put_number(lift, ' ');
        put_number(command.status, ' ');
        put_number(command.iterations, ' ');
        put_number(took, ' ');
        put_number(stack(0), '\n');
        if (step < 0) {
            FN(_controller_reset)(&controller);
        }
    }
    return 0;
}

int main(void)
{
    put_number((long)sizeof controller, ' ');
    put_number(COUNT + 1, '\n');
    return run(0, 0) || run(1, 0) || run(0, 1);
}
