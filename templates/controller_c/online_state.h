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

/* A kind of fault. Each has a status. */
typedef enum { ONLINE_NONE, ONLINE_TILT, ONLINE_JOINT_BEYOND, ONLINE_JOINT_SPEED, ONLINE_BODY_FAR, ONLINE_JOINTS_FAR, ONLINE_BODY_LEAP, ONLINE_JOINTS_LEAP, ONLINE_NOT_AT_START, ONLINE_CLOCK_STANDS, ONLINE_CLOCK_BACK, ONLINE_CLOCK_LEAPS, ONLINE_FROZEN, ONLINE_VELOCITY_MISMATCH, ONLINE_CONTACT_MISMATCH, ONLINE_POOR_STEPS } online_fault;

/* Times since which contacts are as they are, and the floor. */
typedef struct {
    /* Height of the reference's highest foot on the ground, m. */
    real floor_m;
    /* Since when no foot is on the ground, s, and the vertical velocity then, m/s. */
    bool is_aloft;
    double aloft_s;
    real aloft_m_s;
    /* Since when contacts cannot be, s. */
    bool is_contradicted;
    double contradicted_s;
    /* Since when a walk is on the other feet, s. */
    bool is_opposed;
    double opposed_s;
} online_contacts;

/* State of the supervisor between measurements. */
typedef struct {
    /* The present fault; it stays until a reset. */
    online_fault fault;
    /* Time in which torques have faded so far, s. */
    double faded_s;
    /* Whether there was a measurement, and the latest time of one, s. */
    bool has_time;
    double time_s;
    /* Calls in a row without a later time. */
    int standing;
    /* The last measurement of state and velocity, how often it was the same, and the reference when it first was. */
    real seen_x[18];
    real seen_dx[18];
    int frozen;
    real nominal[18];
    /* The last measurement within all bounds, with its time, s. */
    bool has_good;
    double good_s;
    real good_x[18];
    real good_dx[18];
    /* Whether the present one is beyond a bound, and since when measurements are, s. */
    bool is_doubted;
    double doubted_s;
    /* Displacement of the body that its velocity does not explain, fading, m. */
    real unexplained[3];
    online_contacts contacts;
    /* Time without a good plan, s, and that of a step. */
    double poor_s;
    double step_s;
} online_supervisor;

/* Times of the state machine. */
typedef struct {
    /* Time in which the joints move to the reference's first posture, s. */
    double stand_s;
    /* How long the robot stands still before it is ready, and after the reference's end before it recovers, s. */
    double settle_s;
    /* Time in which a commanded velocity goes through its range, s. */
    double range_s;
} online_timing;

/* Modes of the state machine, each with its number for interfaces without enumerations. */
typedef enum { ONLINE_DAMP, ONLINE_STAND_UP, ONLINE_READY, ONLINE_JUMP, ONLINE_LAND, ONLINE_RECOVER, ONLINE_WALK } online_mode;

/* Mode of the state machine, memory of its transitions, and frame of the reference. */
typedef struct {
    online_mode mode;
    /* Whether a jump was requested, or a walk. */
    bool is_asked;
    bool asks_walk;
    /* When the mode began, s, and the joints then, rad. */
    double since_s;
    real from[12];
    /* Where the joints move to, rad. */
    real stand[12];
    /* Whether no foot was on the ground in this jump. */
    bool has_flown;
    /* Since when the body stands still, s. */
    bool is_still;
    double still_s;
    /* The robot's time minus the reference's, s. */
    double offset_s;
    /* A turn about the vertical and a shift: the robot's world to the reference's. */
    real yaw;
    real cosine;
    real sine;
    real place[2];
    real start[2];
} online_routine;

