/* @generated from src/control/online and src/robot by `cargo run -p romc-translate`: types of the controller's own steps.
 * Names that are defined elsewhere: real, the type of numbers; NX and NU, how many states and inputs there are. */

/* Estimate of the share of the commanded input that arrives. */
typedef struct {
    /* gamma, which inputs are divided by. */
    real estimate;
    /* Sum of the faded weights of the steps so far. */
    real weight;
    /* Sum of these weights, each times the share that its step suggests. */
    real weighted;
    /* phi^T phi of the first step, which weights are relative to; zero before. */
    real unit;
} online_share;

/* Controller state between steps. */
typedef struct {
    /* Joint velocities of the present measurement, rad/s; zero if it was refused. */
    real joint_velocity[12];
    /* Feed-forward part of the last torques, N m, without a hold's damping. */
    real feed_forward_nm[12];
    /* Joint positions of the last plan, or those to hold, rad, if there are any. */
    real joint_position[12];
    bool has_position;
    /* Time of the last command, s, if there was one. */
    double command_s;
    bool has_command;
    /* Refused measurements in a row. */
    int disbelieved;
} online_memory;

/* Times of the stages of a plan. */
typedef struct {
    /* Whether there is a plan. */
    bool is_made;
    /* Beginning of the first stage, s. */
    double start_s;
    /* Length of a stage, s. */
    double step_s;
    /* Phase of the first stage. */
    int phase;
} online_plan_time;

