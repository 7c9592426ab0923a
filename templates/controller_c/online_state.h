/* @generated from src/control/online and src/robot by `cargo run -p romc-translate`: types of the controller's own steps.
 * Names that are defined elsewhere: real, the type of numbers; NX and NU, how many states and inputs there are. */

typedef struct {
    /* gamma. */
    real estimate;
    /* Weights of the steps so far, and weights times what the steps say. */
    real weight;
    real weighted;
    /* phi^T phi of the first step, zero before. */
    real unit;
} online_share;

/* What stays from step to step. C is made of it. */
typedef struct {
    /* Of the present measurement, zero unless it is believed. */
    real joint_velocity[12];
    /* Feed-forward part of the last torques, without a hold's damping. */
    real feed_forward_nm[12];
    /* Posture of the last plan, or the one to hold. */
    real joint_position[12];
    bool has_position;
    double command_s;
    bool has_command;
    /* Measurements in a row that were not believed. */
    int disbelieved;
} online_memory;

/* Where the stages of a plan are in time. */
typedef struct {
    /* Whether there is a plan. */
    bool is_made;
    double start_s;
    double step_s;
    /* Phase of the first stage. */
    int phase;
} online_plan_time;

