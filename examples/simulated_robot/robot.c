/* A Go1 in MuJoCo that stands up, jumps and stands again, by the state machine of a generated controller: measurements
 * go in, torques come out, 500 times a second. Prints a line for each mode and four times a second; with a path as
 * argument writes the log there. usage: robot [LOG.csv] */
#include CONTROLLER_HEADER
#include JUMP_HEADER
#include LOG_HEADER
#include ROBOT_HEADER

#include <math.h>
#include <mujoco/mujoco.h>
#include <stdio.h>
#include <string.h>

#define JOINED(name, suffix) name##_##suffix
#define WITH(name, suffix) JOINED(name, suffix)
#define ROMC(suffix) WITH(NAME, suffix)

#define STEP_S 0.002
#define PHYSICS_STEP_S 0.0005
#define MOST_S 12
#define FRICTION 0.8
#define CONTACT_N 1.0
#define SAMPLES (sizeof JUMP_TIME_S / sizeof JUMP_TIME_S[0])

enum { READY = WITH(UPPER, MODE_READY), LAND = WITH(UPPER, MODE_LAND) };

static const char *const LEGS[4] = {"FR", "FL", "RR", "RL"};
static const char *const JOINTS[3] = {"hip", "thigh", "calf"};
static const double TORQUE_LIMIT[3] = {23.7, 23.7, 35.55};

/* Where joints, motors and feet are in MuJoCo's arrays. */
typedef struct {
    mjModel *model;
    mjData *data;
    int position[12], velocity[12], motor[12], foot[4];
} robot;

/* The robot on a floor; its links do not collide with each other, and calves end inside the feet. */
static int load(robot *r, const char *path)
{
    char error[500] = "";
    mjSpec *spec = mj_parseXML(path, NULL, error, sizeof error);
    if (spec == NULL) {
        fprintf(stderr, "%s: %s\n", path, error);
        return 1;
    }
    for (mjsElement *element = mjs_firstElement(spec, mjOBJ_GEOM); element; element = mjs_nextElement(spec, element)) {
        mjsGeom *geom = mjs_asGeom(element);
        const char *body = mjs_getString(mjs_getName(mjs_getParent(element)->element));
        const int is_visual = geom->contype == 0 && geom->conaffinity == 0;
        geom->contype = 0;
        geom->conaffinity = !is_visual && strstr(body, "_calf") == NULL;
    }
    mjsGeom *floor = mjs_addGeom(mjs_findBody(spec, "world"), NULL);
    mjs_setName(floor->element, "floor");
    floor->type = mjGEOM_PLANE;
    floor->size[2] = 0.05;
    floor->contype = 1;
    floor->conaffinity = 0;
    spec->option.timestep = PHYSICS_STEP_S;
    spec->option.integrator = mjINT_IMPLICITFAST;
    r->model = mj_compile(spec, NULL);
    if (r->model == NULL) {
        fprintf(stderr, "%s: %s\n", path, mjs_getError(spec));
        return 1;
    }
    mj_deleteSpec(spec);
    r->data = mj_makeData(r->model);
    for (int leg = 0; leg < 4; ++leg) {
        char name[32];
        r->foot[leg] = mj_name2id(r->model, mjOBJ_GEOM, LEGS[leg]);
        r->model->geom_friction[3 * r->foot[leg]] = FRICTION;
        for (int i = 0; i < 3; ++i) {
            const int joint = 3 * leg + i;
            snprintf(name, sizeof name, "%s_%s_joint", LEGS[leg], JOINTS[i]);
            const int id = mj_name2id(r->model, mjOBJ_JOINT, name);
            snprintf(name, sizeof name, "%s_%s", LEGS[leg], JOINTS[i]);
            r->motor[joint] = mj_name2id(r->model, mjOBJ_ACTUATOR, name);
            r->position[joint] = r->model->jnt_qposadr[id];
            r->velocity[joint] = r->model->jnt_dofadr[id];
            for (int side = 0; side < 2; ++side) {
                const double limit = side ? TORQUE_LIMIT[i] : -TORQUE_LIMIT[i];
                r->model->actuator_ctrlrange[2 * r->motor[joint] + side] = limit;
                r->model->actuator_forcerange[2 * r->motor[joint] + side] = limit;
            }
        }
    }
    return 0;
}

/* Measurements of the robot's sensors and its estimator: state, velocity, feet on the ground. */
static void measure(const robot *r, double x[18], double dx[18], uint8_t feet[4])
{
    const mjData *d = r->data;
    for (int i = 0; i < 12; ++i) {
        x[i] = d->qpos[r->position[i]];
        dx[i] = d->qvel[r->velocity[i]];
    }
    memcpy(x + 12, d->qpos, 3 * sizeof x[0]);
    memcpy(dx + 12, d->qvel, 3 * sizeof x[0]);
    ROMC(attitude)(d->qpos + 3, x + 15);
    ROMC(attitude_rates)(x + 15, d->qvel + 3, dx + 15);
    double force[4] = {0};
    for (int i = 0; i < d->ncon; ++i) {
        double wrench[6];
        mj_contactForce(r->model, d, i, wrench);
        for (int leg = 0; leg < 4; ++leg) {
            const int *geoms = d->contact[i].geom;
            force[leg] += geoms[0] == r->foot[leg] || geoms[1] == r->foot[leg] ? wrench[0] : 0;
        }
    }
    ROMC(feet)(force, CONTACT_N, CONTACT_N, feet);
}

/* On its belly with folded legs, until it lies still. */
static void lie_down(const robot *r)
{
    mj_resetData(r->model, r->data);
    r->data->qpos[2] = 0.12;
    for (int leg = 0; leg < 4; ++leg) {
        r->data->qpos[r->position[3 * leg + 1]] = 1.3;
        r->data->qpos[r->position[3 * leg + 2]] = -2.7;
    }
    while (r->data->time < 1) {
        for (int i = 0; i < 12; ++i) {
            r->data->ctrl[r->motor[i]] = -r->data->qvel[r->velocity[i]];
        }
        mj_step(r->model, r->data);
    }
    r->data->time = 0;
}

static int put(void *file, const char *text, size_t length)
{
    return fwrite(text, 1, length, (FILE *)file) != length;
}

int main(int argc, char **argv)
{
    static ROMC(machine) machine;
    static ROMC(log_row) rows[4000];
    ROMC(log) log;
    ROMC(command) command;
    robot r;
    double x[18], dx[18];
    uint8_t feet[4] = {0};
    if (load(&r, GO1_XML) != 0) {
        return 1;
    }
    ROMC(log_init)(&log, rows, sizeof rows / sizeof rows[0]);
    int status = ROMC(machine_init)(&machine, NULL, NULL);
    if (status == 0) {
        status = ROMC(controller_set_reference_torque)(&machine.controller, SAMPLES, JUMP_TIME_S, JUMP_X[0], JUMP_DX[0],
                                                       JUMP_TORQUE[0], JUMP_FEET[0]);
    }
    if (status != 0) {
        fprintf(stderr, "%s\n", ROMC(controller_status_text)(status));
        return 1;
    }
    lie_down(&r);
    measure(&r, x, dx, feet);
    printf("No software replaces an emergency stop that cuts the power of the motors.\nbounds that are off:");
    for (int i = 0; ROMC(controller_bound_off)(&machine.controller.settings, i) != NULL; ++i) {
        printf(" %s", ROMC(controller_bound_off)(&machine.controller.settings, i));
    }
    printf("%s\n\n time s  x m     height m  mode      status\n", ROMC(controller_bound_off)(&machine.controller.settings, 0) == NULL ? " none" : "");
    double highest = 0, from = 0, to = 0;
    int mode = -1, has_jumped = 0, stands = 0;
    ROMC(machine_stand)(&machine, 0, x);
    for (int step = 0; step * STEP_S < MOST_S && !stands; ++step) {
        const double time_s = step * STEP_S;
        measure(&r, x, dx, feet);
        status = ROMC(machine_step)(&machine, time_s, x, dx, feet, &command);
        ROMC(log_add)(&log, time_s, x, dx, feet, &command);
        ROMC(machine_prepare)(&machine, time_s + STEP_S);
        if (ROMC(machine_mode)(&machine) != mode || step % 125 == 0) {
            mode = ROMC(machine_mode)(&machine);
            printf("%7.3f  %6.3f  %8.3f  %-8s  %s\n", time_s, x[12], x[14], ROMC(machine_mode_text)(mode),
                   ROMC(controller_status_text)(status));
            if (mode == READY && !has_jumped && ROMC(machine_jump)(&machine)) {
                from = x[12];
                has_jumped = 1;
            }
            to = mode == LAND ? x[12] : to;
        }
        highest = has_jumped && x[14] > highest ? x[14] : highest;
        stands = has_jumped && mode == READY && !machine.routine.is_asked && dx[12] * dx[12] + dx[14] * dx[14] < 1e-4;
        for (int i = 0; i < 12; ++i) {
            r.data->ctrl[r.motor[i]] = command.torque[i] + command.stiffness * (command.joint_position[i] - x[i])
                + command.damping * (command.joint_velocity[i] - dx[i]);
        }
        for (int i = 0; i < STEP_S / PHYSICS_STEP_S - 0.5; ++i) {
            mj_step(r.model, r.data);
        }
    }
    const double *end = JUMP_X[SAMPLES - 1];
    double apex = 0;
    for (size_t k = 0; k < SAMPLES; ++k) {
        apex = JUMP_X[k][14] > apex ? JUMP_X[k][14] : apex;
    }
    printf("\n%s: jumped %.3f m (the trajectory %.3f m), highest %.3f m (%.3f m)\n", stands ? "stands" : "does not stand",
           to - from, end[12] - JUMP_X[0][12], highest, apex);
    FILE *file = argc > 1 ? fopen(argv[1], "w") : NULL;
    if (argc > 1 && (!file || ROMC(log_write)(&log, put, file) != 0 || fclose(file) != 0)) {
        fprintf(stderr, "cannot write %s\n", argv[1]);
        return 1;
    }
    mj_deleteData(r.data);
    mj_deleteModel(r.model);
    return !stands;
}
