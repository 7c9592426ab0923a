/* Drives a generated controller through cases read from a file and writes every command.
 *
 * A case: lift, whether there is an input, number of samples, number of steps (int64 each); times,
 * x, dx, u if there is one, feet; a step each: time, x, dx, feet. A command: returned code, status,
 * iterations (int64 each), then torques, positions, velocities and latent input. */
#include <stdio.h>
#include <stdlib.h>

#include HEADER

#define GLUE(a, b) a##b
#define JOIN(a, b) GLUE(a, b)
#define CALL(function) JOIN(NAME, _controller_##function)
typedef JOIN(NAME, _controller) controller_type;
typedef JOIN(NAME, _controller_settings) settings_type;
typedef JOIN(NAME, _command) command_type;
enum { STATE = 18, FEET = 4 };

static FILE *in, *out;

static void *read_all(size_t size, size_t count)
{
    void *values = malloc(size * count);
    if (values == NULL || fread(values, size, count, in) != count) {
        fprintf(stderr, "the cases end too early\n");
        exit(2);
    }
    return values;
}

static void write_numbers(const double *values, size_t count)
{
    fwrite(values, sizeof *values, count, out);
}

static void write_code(int32_t code)
{
    const int64_t wide = code;
    fwrite(&wide, sizeof wide, 1, out);
}

static void steps(controller_type *controller, size_t count)
{
    for (size_t k = 0; k < count; ++k) {
        double *time_s = read_all(sizeof(double), 1);
        double *x = read_all(sizeof(double), STATE), *dx = read_all(sizeof(double), STATE);
        uint8_t *feet = read_all(1, FEET);
        command_type command;
        write_code(CALL(step)(controller, *time_s, x, dx, feet, &command));
        write_code(command.status);
        write_code(command.iterations);
        write_numbers(command.torque, 12);
        write_numbers(command.joint_position, 12);
        write_numbers(command.joint_velocity, 12);
        write_numbers(command.u_lat, sizeof command.u_lat / sizeof *command.u_lat);
        free(time_s);
        free(x);
        free(dx);
        free(feet);
    }
}

int main(int argc, char **argv)
{
    int64_t head[4];
    if (argc != 3 || (in = fopen(argv[1], "rb")) == NULL || (out = fopen(argv[2], "wb")) == NULL)
        return 2;
    while (fread(head, sizeof *head, 4, in) == 4) {
        const size_t count = (size_t)head[2];
        settings_type settings = CALL(settings_default)();
        settings.lift = (int32_t)head[0];
        controller_type *controller = CALL(new)(&settings);
        double *time_s = read_all(sizeof(double), count);
        double *x = read_all(sizeof(double), count * STATE);
        double *dx = read_all(sizeof(double), count * STATE);
        double *u = head[1] != 0 ? read_all(sizeof(double), count * STATE) : NULL;
        uint8_t *feet = read_all(1, count * FEET);
        if (controller == NULL || CALL(set_reference)(controller, count, time_s, x, dx, u, feet) != 0) {
            fprintf(stderr, "%s\n", CALL(last_error)());
            return 1;
        }
        steps(controller, (size_t)head[3]);
        CALL(free)(controller);
        free(time_s);
        free(x);
        free(dx);
        free(u);
        free(feet);
    }
    fclose(in);
    return fclose(out) == 0 ? 0 : 1;
}
