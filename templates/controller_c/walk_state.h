/* @generated from src/control/online by `cargo run -p romc-translate`: types of walks.
 * Names that are defined elsewhere: real, the type of numbers; NX and NU, how many states and inputs there are. */

/* The samples of a walk and the state from which the next sample is computed. */
typedef struct {
    /* Velocity that is commanded, and that of the last sample. */
    real asked[3];
    real now[3];
    /* Whether the robot is to stand, and how many strides it has stepped in place since. */
    bool stops;
    real in_place;
    /* From 0, the stand, to 1, the stride; from when on it is 0 again, s. */
    real amplitude;
    double rest_s;
    /* Share of the stride at the last sample. */
    real share;
    /* Torques at the links of the last sample's stride, N m. */
    real torque[12];
    /* Times, states, their rates, inputs and feet of all samples. */
    double time_s[WALK_WINDOW];
    real x[18 * WALK_WINDOW];
    real dx[18 * WALK_WINDOW];
    real u[18 * WALK_WINDOW];
    bool feet[4 * WALK_WINDOW];
    /* For each sample the path's place (2) and heading in the axes of its beginning, its length along and across
     * (2), and its turning rate. */
    double path[6 * WALK_WINDOW];
} walk_walker;

/* The gait of a walk in SI units; velocities are along the heading, to the left, and of yaw. */
typedef struct {
    /* Nodes of a stride. */
    int count;
    /* Strides a second. */
    real frequency_hz;
    /* Velocities that can be commanded. */
    real least[3];
    /* The largest of them. */
    real most[3];
    /* The mean of the training. */
    real mean[3];
    /* State and input of a robot that stands: z, roll and pitch are its own, x, y and yaw zero. */
    real stand[36];
} walk_gait;

