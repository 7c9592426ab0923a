/* A jump whose measurements go wrong after 60 steps, logged in fewer rows than steps; the log to stdout. */
#include HEADER
#include LOG_HEADER
#include JUMP_HEADER

#include <stdio.h>

#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)
#define OF(name) JOIN(NAME, name)

#define ROWS 50
#define STEPS 90

static int put(void *file, const char *text, size_t length)
{
    return fwrite(text, 1, length, (FILE *)file) != length;
}

/* Refuses the second line. */
static int refuse(void *lines, const char *text, size_t length)
{
    (void)text;
    (void)length;
    return ++*(int *)lines == 2 ? 7 : 0;
}

int main(void)
{
    static OF(_controller) controller;
    static OF(_log_row) rows[ROWS];
    OF(_log) log, none;
    OF(_command) command;
    int lines = 0;
    OF(_log_init)(&log, rows, ROWS);
    OF(_log_init)(&none, rows, 0);
    if (OF(_controller_init)(&controller, NULL) != 0 ||
        OF(_controller_set_reference_torque)(&controller, STEPS + 1, JUMP_TIME_S, JUMP_X[0], JUMP_DX[0], JUMP_TORQUE[0],
                                             JUMP_FEET[0]) != 0) {
        return 1;
    }
    for (size_t k = 0; k < STEPS; ++k) {
        double x[18], dx[18];
        for (int i = 0; i < 18; ++i) {
            x[i] = JUMP_X[k][i];
            dx[i] = JUMP_DX[k][i];
        }
        if (k == 60) {
            dx[12] = (double)NAN;
        } else if (k == 61) {
            x[12] = 1e300;
        } else if (k > 62) {
            x[16] += 0.1 * (double)(k - 62);
        }
        OF(_controller_step)(&controller, JUMP_TIME_S[k], x, dx, JUMP_FEET[k], &command);
        OF(_log_add)(&log, JUMP_TIME_S[k], x, dx, JUMP_FEET[k], &command);
        OF(_log_add)(&none, JUMP_TIME_S[k], x, dx, JUMP_FEET[k], &command);
    }
    /* No measurement. */
    OF(_controller_step)(&controller, 0.9, NULL, NULL, NULL, &command);
    OF(_log_add)(&log, 0.9, NULL, NULL, NULL, &command);
    if (OF(_log_write)(&log, refuse, &lines) != 7 || lines != 2 || OF(_log_write)(&none, refuse, &lines) != 0) {
        return 2;
    }
    return OF(_log_write)(&log, put, stdout);
}
