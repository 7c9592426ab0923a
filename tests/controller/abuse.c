/* Calls a generated controller as it should not be called; every mistake must end in its code and,
 * for steps, in a command that a robot survives. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include HEADER

#define GLUE(a, b) a##b
#define JOIN(a, b) GLUE(a, b)
#define CALL(function) JOIN(NAME, _controller_##function)
#define CODE(word) JOIN(UPPER, _##word)
typedef JOIN(NAME, _controller) controller_type;
typedef JOIN(NAME, _controller_settings) settings_type;
typedef JOIN(NAME, _command) command_type;
enum { STATE = 18, COUNT = 100 };

static double time_s[COUNT], x[COUNT * STATE], dx[COUNT * STATE];
static uint8_t feet[COUNT * 4];
static int faults;

static void expect(const char *what, int found, int expected)
{
    if (found != expected) {
        fprintf(stderr, "%s: %d (%s), expected %d\n", what, found, CALL(status_text)(found), expected);
        ++faults;
    }
}

static void step(controller_type *controller, const char *what, double at, const double *state,
                 const double *speed, const uint8_t *contact, int expected)
{
    command_type command;
    memset(&command, 0xff, sizeof command);
    expect(what, CALL(step)(controller, at, state, speed, contact, &command), expected);
    expect("the command's own status", command.status, expected);
    for (int joint = 0; joint < 12; ++joint)
        if (!(fabs(command.torque[joint]) <= 35.55) || !(fabs(command.joint_position[joint]) < 5.0) ||
            !isfinite(command.joint_velocity[joint])) {
            fprintf(stderr, "%s: joint %d is not safe\n", what, joint);
            ++faults;
        }
}

static void refused(settings_type settings, const char *word)
{
    controller_type *controller = CALL(new)(&settings);
    if (controller != NULL || strstr(CALL(last_error)(), word) == NULL) {
        fprintf(stderr, "settings: %s was not refused: %s\n", word, CALL(last_error)());
        ++faults;
    }
    CALL(free)(controller);
}

static void settings_are_checked(void)
{
    const settings_type base = CALL(settings_default)();
    settings_type bad = base;
    bad.horizon = -5;
    refused(bad, "horizon");
    bad = base;
    bad.lift = 9;
    refused(bad, "lift");
    bad = base;
    bad.step_s = (double)NAN;
    refused(bad, "step_s");
    bad = base;
    bad.max_iterations = 0;
    refused(bad, "max_iterations");
    bad = base;
    bad.max_iterations = -3;
    refused(bad, "max_iterations");
    bad = base;
    bad.horizon = 0;
    refused(bad, "horizon");
    bad = base;
    bad.linearisation = -1;
    refused(bad, "linearisation");
    bad = base;
    bad.body_friction = -0.6;
    refused(bad, "body_friction");
}

static void references_are_checked(controller_type *controller)
{
    expect("no controller", CALL(set_reference)(NULL, COUNT, time_s, x, dx, NULL, feet), CODE(BAD_POINTER));
    expect("no times", CALL(set_reference)(controller, COUNT, NULL, x, dx, NULL, feet), CODE(BAD_POINTER));
    expect("no states", CALL(set_reference)(controller, COUNT, time_s, NULL, dx, NULL, feet), CODE(BAD_POINTER));
    expect("no feet", CALL(set_reference)(controller, COUNT, time_s, x, dx, NULL, NULL), CODE(BAD_POINTER));
    expect("odd address", CALL(set_reference)(controller, 2, time_s, (const double *)(const void *)((const char *)x + 1),
                                              dx, NULL, feet), CODE(BAD_POINTER));
    expect("odd inputs", CALL(set_reference)(controller, 2, time_s, x, dx, (const double *)(const void *)((const char *)dx + 1),
                                             feet), CODE(BAD_POINTER));
    expect("no samples", CALL(set_reference)(controller, 0, time_s, x, dx, NULL, feet), CODE(WRONG_DIMENSION));
    expect("one sample", CALL(set_reference)(controller, 1, time_s, x, dx, NULL, feet), CODE(WRONG_DIMENSION));
    expect("more than memory", CALL(set_reference)(controller, SIZE_MAX / 2, time_s, x, dx, NULL, feet), CODE(BAD_POINTER));
    x[700] = (double)NAN;
    expect("NaN", CALL(set_reference)(controller, COUNT, time_s, x, dx, NULL, feet), CODE(NOT_FINITE));
    x[700] = 0.0;
    time_s[50] = time_s[49];
    expect("equal times", CALL(set_reference)(controller, COUNT, time_s, x, dx, NULL, feet), CODE(TIME_ORDER));
    time_s[50] = 0.1;
}

int main(void)
{
    for (int k = 0; k < COUNT; ++k) {
        time_s[k] = 0.002 * k;
        for (int leg = 0; leg < 4; ++leg) {
            x[k * STATE + 3 * leg + 1] = 0.8;
            x[k * STATE + 3 * leg + 2] = -1.6;
        }
        x[k * STATE + 14] = 0.3;
    }
    memset(feet, 1, sizeof feet);
    settings_are_checked();
    CALL(reset)(NULL);
    CALL(free)(NULL);
    step(NULL, "no controller", 0.0, x, dx, feet, CODE(BAD_POINTER));
    controller_type *controller = CALL(new)(NULL);
    expect("no command", CALL(step)(controller, 0.0, x, dx, feet, NULL), CODE(BAD_POINTER));
    step(controller, "no reference", 0.0, x, dx, feet, CODE(NO_REFERENCE));
    references_are_checked(controller);
    expect("a sound reference", CALL(set_reference)(controller, COUNT, time_s, x, dx, NULL, feet), 0);
    references_are_checked(controller);
    step(controller, "no state", 0.0, NULL, dx, feet, CODE(BAD_POINTER));
    step(controller, "no feet", 0.0, x, dx, NULL, CODE(BAD_POINTER));
    step(controller, "time is NaN", (double)NAN, x, dx, feet, CODE(NOT_FINITE));
    dx[3] = (double)INFINITY;
    step(controller, "velocity is infinite", 0.0, x, dx, feet, CODE(NOT_FINITE));
    dx[3] = 0.0;
    step(controller, "sound again", 0.0, x, dx, feet, 0);
    step(controller, "the same time", 0.0, x, dx, feet, 0);
    step(controller, "a little earlier", -0.004, x, dx, feet, 0);
    CALL(reset)(controller);
    step(controller, "after a reset", 0.02, x, dx, feet, 0);
    if (strcmp(CALL(status_text)(1234), "unknown status") != 0)
        ++faults;
    CALL(free)(controller);
    return faults == 0 ? 0 : 1;
}
