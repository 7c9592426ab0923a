/* @generated from src/control/online and src/robot by `cargo run -p romc-translate`: the controller's own steps.
 * Names that are defined elsewhere: real, the type of numbers; NX and NU, how many states and inputs there are. */

/* How far a clock may go back, s: measurements may be exchanged. */
#define ONLINE_CLOCK_JITTER_S 0.005

/* Curvature of the cost as the solvers have it: CURVATURE / 2 ‖v‖². Inputs a few deviations beyond the limits then
 * have multipliers near those at which iterations begin. */
#define ONLINE_CURVATURE (real)0.01

/* Smallest standard deviation against the largest of the same kind. */
#define ONLINE_DEVIATION_FLOOR (real)1e-2

/* Joint speed within which dry friction changes its sign, in rad/s. */
#define ONLINE_DRY_SPEED_RAD_S (real)0.05

/* By how much feet may touch down too early, s. */
#define ONLINE_EARLY_S 0.04

/* Time in the air after which a body has to fall, s, and the least share of gravity. */
#define ONLINE_FALL_S 0.03

#define ONLINE_FALL_SHARE (real)0.5

/* Height above the floor at which a foot is not on it, m. */
#define ONLINE_FOOT_UP_M (real)0.06

/* Gap between primal and dual cost, relative to the cost, at which they end as well. */
#define ONLINE_GAP (real)1e-8

/* Acceleration of free fall, in m/s^2. */
#define ONLINE_GRAVITY_M_S2 9.81

/* Tilts from half a turn on are none. */
#define ONLINE_HALF_TURN (real)3.1

/* Half width of the window in which velocities are fitted by a straight line, s. */
#define ONLINE_HALF_WINDOW_S (0.016 + 1e-9)

/* Torques that are kept are so far inside the limits, as a share, that rounding does not put them beyond. */
#define ONLINE_INSIDE (real)0.999

#define ONLINE_LARGEST (real)1.3

/* Largest number of a measurement, SI: beyond it none is real, and a solver would iterate in vain. */
#define ONLINE_LARGEST_MEASURED (real)1e6

/* Largest weight of a step, in first steps. */
#define ONLINE_LARGEST_WEIGHT (real)2.0

/* How long the joints may need, in times that they should, before they are not at the start. */
#define ONLINE_LATEST 2.0

/* Smallest and largest estimate. */
#define ONLINE_LEAST (real)0.7

#define ONLINE_LIFT_ITERATIONS 60

/* A gap of up to this many steps between two measurements is always accepted. */
#define ONLINE_LONGEST_STEPS 1.5

/* Time over which velocities are compared with positions, s. */
#define ONLINE_MEMORY_S (real)0.05

/* Error of pitch beyond which legs turn no further, rad. */
#define ONLINE_MOST_TURN_RAD (real)0.3

/* The first measurement must be within this share of the distances from the reference. Every later one must be within
 * it of a prediction: the last good measurement moved by its velocity, or by the mean of both velocities. */
#define ONLINE_NEAR (real)0.5

/* Phase of feet that select none. */
#define ONLINE_NO_PHASE 255

/* Longest time that a walk may be on the other feet: twice that by which feet may be early, s. */
#define ONLINE_OPPOSED_S 0.08

/* How long measurements are refused before they are a fault, s. */
#define ONLINE_PATIENCE_S 0.019

/* Lead of the commanded posture, in stages, relative to the middle of the time for which it is held. A joint PD that
 * holds the posture of the end of a stage leads the motion and adds to the thrust; with that of the middle it reduces
 * the thrust. */
#define ONLINE_POSTURE_LEAD 0.4

/* Weight of the one from before the motion, in first steps. */
#define ONLINE_PRIOR_WEIGHT (real)10.0

/* How far a reference moves, rad or m, while a measurement that stays the same is not believed. */
#define ONLINE_REFERENCE_MOVES (real)0.01

/* Smallest |det J|, divided by LegShape::volume, at which torques still give a foot force: a knee about 1e-3 rad
 * from full extension. */
#define ONLINE_SINGULAR_BOUND (real)1e-3

/* Price of a slack in the program; the whole cost is scaled to it. clarabel starts with all multipliers near one. It
 * needs two iterations more to increase them to 100. */
#define ONLINE_SLACK_PRICE (real)10.0

/* Angle over which the height of a foot is differentiated, rad. */
#define ONLINE_SMALL_TURN (real)1e-3

/* Violation of a joint limit, in half ranges, above which a plan counts as softened. It is larger than the violation
 * that omitted rows may hide. */
#define ONLINE_SOFTENED_FROM (real)(1.05 * 0.02)

/* Distance from the reference, in its standard deviations, within which joint limits matter. */
#define ONLINE_STATE_REACH (real)4.0

/* Speed of the body below which it stands still, m/s. */
#define ONLINE_STILL_M_S (real)0.1

/* Share of a joint's half range within which a trajectory stands still. */
#define ONLINE_STILL_SHARE (real)0.02

/* Time in which one that stands still might cover that, s. */
#define ONLINE_STILL_TIME_S (real)0.1

/* Times closer than this are the same, s. */
#define ONLINE_TIME_TOLERANCE_S 1e-9

/* Cosine of the angle between the body's and the vertical downwards above which a robot is near upside down. */
#define ONLINE_UPSIDE_DOWN (real)0.5

/* Share of a stage from which on a command counts as held for all of it. */
#define ONLINE_WHOLE_STAGE 0.75

/* Bounds of measurements, and the damping that follows a violation; infinite bounds and counts of zero disable a
 * check. docs/explanation/supervisor.md, "The supervisor", defines the quantity that each bound limits. */
typedef struct {
    real tilt_rad;
    real joint_margin_rad;
    real joint_velocity;
    real distance_m;
    real posture_rad;
    double clock_gap_s;
    int frozen_steps;
    real velocity_mismatch;
    int contact_mismatch_steps;
    int poor_steps;
    double fade_s;
    real damping_nm_s_rad;
    real damping_torque_nm;
} online_bounds;

/* Whether the feet are where the reference has them. */
typedef enum { ONLINE_AS_SCHEDULED, ONLINE_EARLY, ONLINE_LATE, ONLINE_UNKNOWN } online_contact;

/* Behaviour of the controller without a trusted plan. */
typedef struct {
    /* How many stages of the last good plan may be used after a failure. */
    int plan_stages;
    /* Time constant with which the feed-forward torque of a hold decays, s. */
    real torque_decay_s;
    /* Joint damping of a hold, N m s/rad, on measured joint velocities. */
    real damping_nm_s;
    /* Deviation from the prediction, in standard deviations of the reference, that is not believed at first. */
    real jump_deviations;
    /* Number of consecutive steps in which a measurement is refused as a jump before it is accepted. */
    int jump_patience;
} online_fallback_settings;

/* Where a time is: the last sample at or before it, and how far it is on the way to the next one. */
typedef struct {
    int sample;
    real share;
} online_instant;

/* A leg in the frame of its plane at the zero posture. */
typedef struct {
    /* Shares of forward, normal and up, in the body's axes, that stay as the first joint turns. */
    real fixed[3][3];
    /* Shares that its cosine multiplies. */
    real cosine[3][3];
    /* Shares that its sine multiplies. */
    real sine[3][3];
    /* Axis of the first joint. */
    real axis[3];
    /* From the first joint to the foot, without thigh and calf in the plane, m. */
    real hip[3];
    /* Forward and up, m. */
    real thigh[2];
    /* Forward and up, m. */
    real calf[2];
    /* 1 where the third joint turns as the second does, -1 where it turns against it. */
    real knee;
    /* Area that thigh and calf span (m^2) and height of the foot (m) below which they are damped. */
    real least[2];
    /* Thigh times calf times their sum, m^3, which bounds |det J|. */
    real volume;
} online_leg_shape;

/* How a latent input becomes joint torques, each way with its number for interfaces without enumerations. */
typedef enum { ONLINE_TRANSPOSE, ONLINE_CONSISTENT } online_lift;

/* Where the foot is and how the joints move it, in the frame of the leg's plane. */
typedef struct {
    /* The frame in the body's axes. */
    real frame[3][3];
    /* Foot from the first joint, m. */
    real foot[3];
    /* Velocity of the foot per velocity of the first joint. */
    real by_first[3];
    /* From the second joint to the foot: forward and up. */
    real limb[2];
    /* From the third joint to the foot. */
    real calf[2];
} online_posture;

/* A kind of rows; rows, place in a stage and size are stated here alone, for both solvers and the controller in C. */
typedef enum { ONLINE_TORQUE_LIMIT, ONLINE_TORQUE_RATE, ONLINE_JOINT_LIMIT, ONLINE_BODY_FRICTION } online_row_kind;

/* Nodes of the classical Runge-Kutta method: the internal state is x + node . h . previous slope. */
static const real ONLINE_NODES[4] = {(real)0.0, (real)0.5, (real)0.5, (real)1.0};

/* Weights of its slopes. */
static const real ONLINE_WEIGHTS[4] = {(real)(1.0 / 6.0), (real)(1.0 / 3.0), (real)(1.0 / 3.0), (real)(1.0 / 6.0)};

/* Lower Cholesky factor of a row-major symmetric matrix in place of its lower triangle; false if it is not positive
 * definite. */
static MAYBE_UNUSED bool online_factorise(real *matrix, int dim)
{
    for (int i = 0; i < dim; ++i) {
        for (int j = 0; j <= i; ++j) {
            real entry = matrix[i * dim + j];
            for (int k = 0; k < j; ++k) {
                entry -= matrix[i * dim + k] * matrix[j * dim + k];
            }
            if (i != j) {
                matrix[i * dim + j] = entry / matrix[j * dim + j];
            } else if (entry > 0 && solver_is_finite_number(entry)) {
                matrix[i * dim + i] = SQRT(entry);
            } else {
                return false;
            }
        }
    }
    return true;
}

/* L^-1 b in place of b. */
static MAYBE_UNUSED void online_solve_lower(const real *factor, int dim, real *restrict b)
{
    for (int i = 0; i < dim; ++i) {
        for (int k = 0; k < i; ++k) {
            b[i] -= factor[i * dim + k] * b[k];
        }
        b[i] /= factor[i * dim + i];
    }
}

/* L^-T b in place of b. */
static MAYBE_UNUSED void online_solve_upper(const real *factor, int dim, real *restrict b)
{
    for (int i = dim - 1; i >= 0; --i) {
        for (int k = i + 1; k < dim; ++k) {
            b[i] -= factor[k * dim + i] * b[k];
        }
        b[i] /= factor[i * dim + i];
    }
}

/* sum += factor values. */
static MAYBE_UNUSED void online_add_scaled(real factor, const real *values, int dim, real *restrict sum)
{
    for (int i = 0; i < dim; ++i) {
        sum[i] += factor * values[i];
    }
}

/* Adds S B^T (B S B^T + R)^-1 y to an input, unless the sum in brackets is not positive definite. Matrices are
 * row-major; y is overwritten. */
static MAYBE_UNUSED void online_add_correction(const real *gain, const real *covariance, const real *residual, int d,
        real *restrict unexplained, real *restrict input)
{
    real spread[D * D] = {0};
    real square[D * D] = {0};
    real estimate[D] = {0};
    for (int i = 0; i < d; ++i) {
        for (int j = 0; j < d; ++j) {
            for (int k = 0; k < d; ++k) {
                spread[i * d + j] += gain[i * d + k] * covariance[k * d + j];
            }
        }
        for (int j = 0; j <= i; ++j) {
            square[i * d + j] = residual[i * d + j];
            for (int k = 0; k < d; ++k) {
                square[i * d + j] += spread[i * d + k] * gain[j * d + k];
            }
        }
    }
    if (!online_factorise(square, d)) {
        return;
    }
    online_solve_lower(square, d, unexplained);
    online_solve_upper(square, d, unexplained);
    bool is_finite = true;
    for (int j = 0; j < d; ++j) {
        for (int i = 0; i < d; ++i) {
            estimate[j] += spread[i * d + j] * unexplained[i];
        }
        is_finite = is_finite && solver_is_finite_number(estimate[j]);
    }
    if (is_finite) {
        online_add_scaled(1, estimate, d, input);
    }
}

/* Updates a leg from its joint angles, where the foot's offset along the normal is already set. The third sine and
 * cosine are those of the calf's angle, the sum of the second and third joint's. */
static MAYBE_UNUSED void online_posture_turn(online_posture *restrict self, const online_leg_shape *leg,
        const real *sine, const real *cosine)
{
    for (int k = 0; k < 3; ++k) {
        for (int i = 0; i < 3; ++i) {
            const real turned = cosine[0] * leg->cosine[k][i] + sine[0] * leg->sine[k][i];
            self->frame[k][i] = turned + leg->fixed[k][i];
        }
    }
    self->calf[0] = sine[2] * leg->calf[1] + cosine[2] * leg->calf[0];
    self->calf[1] = cosine[2] * leg->calf[1] - sine[2] * leg->calf[0];
    self->limb[0] = sine[1] * leg->thigh[1] + cosine[1] * leg->thigh[0] + self->calf[0];
    self->limb[1] = cosine[1] * leg->thigh[1] - sine[1] * leg->thigh[0] + self->calf[1];
    self->foot[0] = self->limb[0] + leg->hip[0];
    self->foot[2] = self->limb[1] + leg->hip[2];
    self->by_first[0] = self->foot[2] * leg->axis[1] - self->foot[1] * leg->axis[2];
    self->by_first[1] = self->foot[0] * leg->axis[2] - self->foot[2] * leg->axis[0];
    self->by_first[2] = self->foot[1] * leg->axis[0] - self->foot[0] * leg->axis[1];
}

/* Turns a leg by the angles of its joints, rad. */
static MAYBE_UNUSED void online_posture_bend(online_posture *restrict self, const online_leg_shape *leg,
        const real *q)
{
    const real calf = q[1] + leg->knee * q[2];
    real sine[3] = {SIN(q[0]), SIN(q[1]), SIN(calf)};
    real cosine[3] = {COS(q[0]), COS(q[1]), COS(calf)};
    self->foot[1] = leg->hip[1];
    online_posture_turn(self, leg, sine, cosine);
}

/* A leg at the angles of its joints, rad. */
static MAYBE_UNUSED online_posture online_posture_bent(const online_leg_shape *leg, const real *q)
{
    online_posture posture = {.frame = {{0}}, .foot = {0}, .by_first = {0}, .limb = {0}, .calf = {0}};
    online_posture_bend(&posture, leg, q);
    return posture;
}

/* Writes a vector of the frame in the body's axes. */
static MAYBE_UNUSED void online_posture_write_in_body(online_posture *self, const real *vector, real out[restrict 3])
{
    for (int i = 0; i < 3; ++i) {
        out[i] = self->frame[0][i] * vector[0] + self->frame[1][i] * vector[1] + self->frame[2][i] * vector[2];
    }
}

/* Area that thigh and calf span, with its sign, m^2. */
static MAYBE_UNUSED real online_posture_area(online_posture *self)
{
    return self->limb[1] * self->calf[0] - self->limb[0] * self->calf[1];
}

/* Lever of the first joint along the normal, m; times the area it is det J, up to the sign. */
static MAYBE_UNUSED real online_posture_lever(online_posture *self)
{
    return -self->by_first[1];
}

/* Writes J[i][j] = d p_i / d q_j of the foot in the body's axes, m. */
static MAYBE_UNUSED void online_posture_write_jacobian(online_posture *self, const online_leg_shape *leg,
        real jacobian[restrict 3][3])
{
    real first[3] = {0};
    online_posture_write_in_body(self, self->by_first, first);
    for (int i = 0; i < 3; ++i) {
        const real forward = self->frame[0][i];
        const real up = self->frame[2][i];
        jacobian[i][0] = first[i];
        jacobian[i][1] = forward * self->limb[1] - up * self->limb[0];
        jacobian[i][2] = leg->knee * (forward * self->calf[1] - up * self->calf[0]);
    }
}

/* Writes -J^-T by cofactors; false if there is none. */
static MAYBE_UNUSED bool online_minus_inverse_transpose(real j[3][3], real out[restrict 3][3])
{
    const real minor_0 = j[1][1] * j[2][2] - j[1][2] * j[2][1];
    const real minor_1 = j[0][1] * j[2][2] - j[0][2] * j[2][1];
    const real minor_2 = j[0][1] * j[1][2] - j[0][2] * j[1][1];
    const real det = j[0][0] * minor_0 - j[1][0] * minor_1 + j[2][0] * minor_2;
    if ((det <= 0 && det >= 0) || !solver_is_finite_number(det)) {
        return false;
    }
    out[0][0] = -(minor_0 / det);
    out[1][0] = minor_1 / det;
    out[2][0] = -(minor_2 / det);
    out[0][1] = -((j[1][2] * j[2][0] - j[1][0] * j[2][2]) / det);
    out[0][2] = -((j[1][0] * j[2][1] - j[1][1] * j[2][0]) / det);
    out[1][1] = -((j[2][2] * j[0][0] - j[2][0] * j[0][2]) / det);
    out[1][2] = -((j[2][0] * j[0][1] - j[2][1] * j[0][0]) / det);
    out[2][1] = -((j[0][2] * j[1][0] - j[0][0] * j[1][2]) / det);
    out[2][2] = -((j[0][0] * j[1][1] - j[0][1] * j[1][0]) / det);
    return true;
}

/* 1 / d, but d / least^2 where |d| is below the least. */
static MAYBE_UNUSED real online_damped_reciprocal(real d, real least)
{
    const real square = d * d;
    const real smallest = least * least;
    return d / (square > smallest ? square : smallest);
}

/* Writes -J^-T with damped levers. */
static MAYBE_UNUSED void online_posture_write_damped(online_posture *self, const online_leg_shape *leg,
        real map[restrict 3][3])
{
    const real of_area = online_damped_reciprocal(online_posture_area(self), leg->least[0]);
    const real of_lever = online_damped_reciprocal(online_posture_lever(self), leg->least[1]);
    const real calf = -of_area;
    const real limb = leg->knee * of_area;
    real forward[3] = {0, self->calf[0] * calf, self->limb[0] * limb};
    real up[3] = {0, self->calf[1] * calf, self->limb[1] * limb};
    for (int j = 0; j < 3; ++j) {
        const real own = j == 0 ? 1 : 0;
        const real by_plane = self->by_first[0] * forward[j] + self->by_first[2] * up[j];
        real force[3] = {forward[j], (own + by_plane) * of_lever, up[j]};
        real column[3] = {0};
        online_posture_write_in_body(self, force, column);
        for (int i = 0; i < 3; ++i) {
            map[i][j] = column[i];
        }
    }
}

/* Writes -J^-T of a leg, which maps its torques (N m) to its force on the body (N), and the position of the foot
 * relative to the first joint, m. Levers are never shorter than the least; in the exact variant the result is false if
 * the leg is stretched. */
static MAYBE_UNUSED bool online_write_force_map(const online_leg_shape *leg, const real *q, bool is_exact,
        real map[restrict 3][3], real foot[restrict 3])
{
    online_posture posture = online_posture_bent(leg, q);
    online_posture_write_in_body(&posture, posture.foot, foot);
    const real area = solver_magnitude(online_posture_area(&posture));
    const real lever = solver_magnitude(online_posture_lever(&posture));
    if (is_exact && area * lever / leg->volume < ONLINE_SINGULAR_BOUND) {
        return false;
    }
    if (is_exact || (area >= leg->least[0] && lever >= leg->least[1])) {
        real jacobian[3][3] = {{0}};
        online_posture_write_jacobian(&posture, leg, jacobian);
        return online_minus_inverse_transpose(jacobian, map);
    }
    online_posture_write_damped(&posture, leg, map);
    return true;
}

/* Writes the moment of a force at a foot about where its hip is from. */
static MAYBE_UNUSED void online_write_moment(const real *hip, const real *foot, const real *force,
        real *restrict moment)
{
    real arm[3] = {hip[0] + foot[0], hip[1] + foot[1], hip[2] + foot[2]};
    moment[0] = arm[1] * force[2] - arm[2] * force[1];
    moment[1] = arm[2] * force[0] - arm[0] * force[2];
    moment[2] = arm[0] * force[1] - arm[1] * force[0];
}

/* Adds force and moment on the body of a leg's torques to a wrench, with the moment about the origin of the
 * hip's position vector. False if the torques are not finite or the leg has no force map. The angles must be finite. */
static MAYBE_UNUSED bool online_add_wrench(const online_leg_shape *leg, const real *hip, const real *q,
        const real *torque, real *restrict wrench)
{
    real map[3][3] = {{0}};
    real arm[3] = {0};
    const bool is_finite = solver_is_finite_number(torque[0]) && solver_is_finite_number(torque[1])
            && solver_is_finite_number(torque[2]);
    if (!is_finite || !online_write_force_map(leg, q, false, map, arm)) {
        return false;
    }
    real force[3] = {0};
    for (int i = 0; i < 3; ++i) {
        force[i] = map[i][0] * torque[0] + map[i][1] * torque[1] + map[i][2] * torque[2];
    }
    real moment[3] = {0};
    online_write_moment(hip, arm, force, moment);
    for (int i = 0; i < 3; ++i) {
        wrench[i] += force[i];
        wrench[3 + i] += moment[i];
    }
    return true;
}

/* Writes row C. */
static MAYBE_UNUSED void online_by_deviation(const real *row, const real *deviation, real *restrict out)
{
    for (int j = 0; j < 12; ++j) {
        out[j] = 0;
        for (int k = 0; k <= j; ++k) {
            out[j] += row[k] * deviation[12 * k + j];
        }
    }
}

/* Rows on the torques become rows on v. */
static MAYBE_UNUSED void online_change_rows(const real *hessian, const real *deviation, int count,
        real *restrict rows)
{
    real changed[12] = {0};
    for (int row = 0; row < count; ++row) {
        online_by_deviation(rows + 12 * row, deviation, changed);
        online_solve_lower(hessian, 12, changed);
        for (int j = 0; j < 12; ++j) {
            rows[12 * row + j] = changed[j];
        }
    }
}

/* The nearest torque within a limit; zero for NaN. */
static MAYBE_UNUSED real online_clamped_torque(real torque, real limit)
{
    return torque >= -limit ? (torque > limit ? limit : torque) : torque < 0 ? -limit : 0;
}

/* The first of these numbers that is infinite or undefined; count without one. */
static MAYBE_UNUSED int online_first_undefined(const real *values, int count)
{
    for (int i = 0; i < count; ++i) {
        if (!solver_is_finite_number(values[i])) {
            return i;
        }
    }
    return count;
}

/* Height of a leg's foot at a state of the robot, m; q are the leg's angles. */
static MAYBE_UNUSED real online_foot_height(const online_leg_shape *leg, const real *hip, const real *x,
        const real *q)
{
    online_posture posture = online_posture_bent(leg, q);
    real foot[3] = {0};
    online_posture_write_in_body(&posture, posture.foot, foot);
    const real aside = SIN(x[15]) * (hip[1] + foot[1]);
    const real above = COS(x[15]) * (hip[2] + foot[2]);
    return x[14] - SIN(x[16]) * (hip[0] + foot[0]) + COS(x[16]) * (aside + above);
}

/* Writes A and y_0; false if a number is not finite. wrench is G; matrices are row-major. */
static MAYBE_UNUSED bool online_free_optimum(const real *projection, const real *wrench, const real *mean,
        const real *deviation, const real *u_lat, real prior_weight, int d, real *restrict scaled_map,
        real *restrict y)
{
    const real scale = 1 / SQRT(prior_weight);
    real row[12] = {0};
    real residual[D] = {0};
    real square[D * D] = {0};
    for (int i = 0; i < d; ++i) {
        const real *own = projection + 18 * i;
        real left = u_lat[i];
        for (int j = 0; j < 12; ++j) {
            real by_wrench = 0;
            for (int axis = 0; axis < 6; ++axis) {
                by_wrench += wrench[12 * axis + j] * own[12 + axis];
            }
            row[j] = own[j] + by_wrench;
            left -= row[j] * mean[j];
        }
        online_by_deviation(row, deviation, scaled_map + 12 * i);
        for (int j = 0; j < 12; ++j) {
            scaled_map[12 * i + j] *= scale;
        }
        residual[i] = scale * left;
    }
    for (int i = 0; i < d; ++i) {
        for (int j = 0; j <= i; ++j) {
            real sum = i == j ? 1 : 0;
            for (int k = 0; k < 12; ++k) {
                sum += scaled_map[12 * i + k] * scaled_map[12 * j + k];
            }
            square[i * d + j] = sum;
        }
    }
    if (!online_factorise(square, d)) {
        return false;
    }
    online_solve_lower(square, d, residual);
    online_solve_upper(square, d, residual);
    for (int j = 0; j < 12; ++j) {
        y[j] = 0;
    }
    for (int i = 0; i < d; ++i) {
        online_add_scaled(residual[i], scaled_map + 12 * i, 12, y);
    }
    return true;
}

/* Whether times are the same but for rounding. */
static MAYBE_UNUSED bool online_is_same_time(double time_s, double other_s)
{
    const double off_s = time_s - other_s;
    return off_s < ONLINE_TIME_TOLERANCE_S && off_s > -ONLINE_TIME_TOLERANCE_S;
}

/* Moves torques that are with the losses beyond the limits to these. */
static MAYBE_UNUSED void online_keep_limits(const real *limit_nm, const real *losses_nm, real *restrict torque)
{
    for (int i = 0; i < 12; ++i) {
        const real least = -limit_nm[i] - losses_nm[i];
        const real most = limit_nm[i] - losses_nm[i];
        torque[i] = torque[i] < least ? least : torque[i];
        torque[i] = torque[i] > most ? most : torque[i];
    }
}

/* The larger of two numbers; the second if the first is not one. */
static MAYBE_UNUSED real online_greater(real value, real other)
{
    return value > other ? value : other;
}

/* The smaller of two numbers; the second if the first is not one. */
static MAYBE_UNUSED real online_smaller(real value, real other)
{
    return value < other ? value : other;
}

/* Legs in the air get the torques of the reference, or zero at the links if it has none, clamped to the limits. */
static MAYBE_UNUSED void online_keep_swing(bool *is_down, bool is_known, const real *limit_nm, const real *losses_nm,
        real *restrict mean, real *restrict deviation)
{
    for (int joint = 0; joint < 12; ++joint) {
        if (!is_down[joint / 3]) {
            const real least = -ONLINE_INSIDE * limit_nm[joint] - losses_nm[joint];
            const real most = ONLINE_INSIDE * limit_nm[joint] - losses_nm[joint];
            const real kept = is_known ? mean[joint] : 0;
            mean[joint] = online_smaller(online_greater(kept, least), most);
            for (int k = 0; k < 12; ++k) {
                deviation[12 * joint + k] = 0;
            }
        }
    }
}

/* b dq + c tanh(dq / v) + I ddq of a joint with these b, c and I, N m, at dq (rad/s) and ddq (rad/s^2). */
static MAYBE_UNUSED real online_joint_loss(const real *of, real dq, real ddq)
{
    return of[0] * dq + of[1] * TANH(dq / ONLINE_DRY_SPEED_RAD_S) + of[2] * ddq;
}

/* Loss of a joint, N m, over a time between two velocities: at their mean, with their difference as acceleration. At
 * most the limit. */
static MAYBE_UNUSED real online_planned_loss(const real *of, real before, real after, real step_s, real limit)
{
    const real dq = (real)0.5 * (before + after);
    const real ddq = (after - before) / step_s;
    return online_clamped_torque(online_joint_loss(of, dq, ddq), limit);
}

/* Returns the limit by which unit rows are divided, for cones the friction coefficient. Zero if the settings do not
 * request this kind. */
static MAYBE_UNUSED real online_row_size(online_row_kind kind, const online_settings *settings)
{
    /* The consistent lift enforces the torque limits by itself. */
    if (kind == ONLINE_TORQUE_LIMIT && settings->lift != (int)ONLINE_CONSISTENT) {
        return 1;
    }
    if (kind == ONLINE_TORQUE_RATE) {
        return settings->torque_rate_nm_s * (real)settings->step_s;
    }
    if (kind == ONLINE_JOINT_LIMIT) {
        return 1;
    }
    if (kind == ONLINE_BODY_FRICTION) {
        return settings->body_friction;
    }
    return 0;
}

/* Writes sigma^-1 A sigma, sigma^-1 B C_p and sigma^-1 defect of derivatives (A B), 2d x 3d; all row-major but C_p, lower
 * triangular, column by column. */
static MAYBE_UNUSED void online_scale_dynamics(const real *by, const real *defect, const real *root,
        const real *deviation, int d, real *restrict a, real *restrict b, real *restrict c)
{
    for (int i = 0; i < 2 * d; ++i) {
        const real factor = 1 / deviation[i];
        c[i] = factor * defect[i];
        const real *row = by + 3 * i * d;
        for (int j = 0; j < d; ++j) {
            real sum = 0;
            for (int k = j; k < d; ++k) {
                sum += row[2 * d + k] * root[j * d + k];
            }
            b[i * d + j] = factor * sum;
        }
        for (int j = 0; j < 2 * d; ++j) {
            a[2 * i * d + j] = factor * row[j] * deviation[j];
        }
    }
}

/* Writes row C_p; returns row . input. */
static MAYBE_UNUSED real online_scale_row(const real *row, const real *root, const real *input, int d,
        real *restrict out)
{
    real at_reference = 0;
    for (int j = 0; j < d; ++j) {
        real sum = 0;
        for (int k = j; k < d; ++k) {
            sum += row[k] * root[j * d + k];
        }
        out[j] = sum;
        at_reference += row[j] * input[j];
    }
    return at_reference;
}

/* By how many of its stages a horizon that begins at a time moves on to begin at another: 0 unless they are whole. */
static MAYBE_UNUSED int online_stages_between(double from_s, double to_s, double step_s, int horizon)
{
    const double passed = (to_s - from_s) / step_s;
    const double whole = FLOOR(passed + 0.5);
    const bool is_whole = online_is_same_time((passed - whole) * step_s, 0.0);
    const bool is_within = is_whole && whole >= 1.0 && whole < (double)horizon;
    return is_within ? (int)whole : 0;
}

/* Computes the defect for a reference that is itself a trajectory. It is zero when linearised about the reference.
 * Otherwise the defect of nominal, the model's step from the reference, is subtracted. */
static MAYBE_UNUSED void online_trust_reference(bool is_about_plan, const real *nominal, const real *end, int d,
        real *restrict defect)
{
    for (int i = 0; i < 2 * d; ++i) {
        const real left = defect[i] + (end[i] - nominal[i]);
        defect[i] = is_about_plan ? left : 0;
    }
}

/* Writes the rows (mu F_z, F_x, F_y) of a force along x, y and z turned by a rotation, row-major. */
static MAYBE_UNUSED void online_turn_force(const real *rotation, const real *x, const real *y, const real *z,
        real coefficient, int d, real *restrict out)
{
    for (int row = 0; row < 3; ++row) {
        const real *turned = rotation + 3 * ((row + 2) % 3);
        for (int j = 0; j < d; ++j) {
            real sum = turned[0] * x[j];
            sum += turned[1] * y[j];
            sum += turned[2] * z[j];
            out[row * d + j] = row == 0 ? coefficient * sum : sum;
        }
    }
}

/* Turns the foot of a leg about the body's origin by the opposite of an error e of pitch (rad). Nothing holds the
 * pitch of a body in the air, so its feet would otherwise land elsewhere than planned. To first order the joints
 * become q + J^-1 (R_y(-e) - 1) (h + p(q)) with the hip h. A foot that cannot be moved stays. */
static MAYBE_UNUSED void online_turn_leg(const online_leg_shape *leg, const real *hip, real error, real *restrict q)
{
    real map[3][3] = {{0}};
    real foot[3] = {0};
    if (!online_write_force_map(leg, q, false, map, foot)) {
        return;
    }
    const real most = ONLINE_MOST_TURN_RAD;
    const real limit = error < 0 ? -most : most;
    const real turn = solver_magnitude(error) > most ? limit : error;
    const real sine = SIN(turn);
    const real shrunk = COS(turn) - 1;
    const real x = hip[0] + foot[0];
    const real z = hip[2] + foot[2];
    const real forward = shrunk * x - sine * z;
    const real up = sine * x + shrunk * z;
    for (int j = 0; j < 3; ++j) {
        /* The map is -J^-T. */
        q[j] -= map[0][j] * forward + map[2][j] * up;
    }
}

/* Writes rows of two maps at an attitude of roll, pitch and yaw (rad). The first is the rotation from the body's axes
 * to the world's. The second maps moments about the body's axes to the generalised moments of roll, pitch and yaw. */
static MAYBE_UNUSED void online_write_world_axes(const real *attitude, real turned[restrict 3][3],
        real rates[restrict 3][3])
{
    const real sr = SIN(attitude[0]);
    const real cr = COS(attitude[0]);
    const real sp = SIN(attitude[1]);
    const real cp = COS(attitude[1]);
    const real sy = SIN(attitude[2]);
    const real cy = COS(attitude[2]);
    turned[0][0] = cy * cp;
    turned[0][1] = cy * sp * sr - sy * cr;
    turned[0][2] = cy * sp * cr + sy * sr;
    turned[1][0] = sy * cp;
    turned[1][1] = sy * sp * sr + cy * cr;
    turned[1][2] = sy * sp * cr - cy * sr;
    turned[2][0] = -sp;
    turned[2][1] = cp * sr;
    turned[2][2] = cp * cr;
    rates[0][0] = 1;
    rates[0][1] = 0;
    rates[0][2] = 0;
    rates[1][0] = 0;
    rates[1][1] = cr;
    rates[1][2] = -sr;
    for (int i = 0; i < 3; ++i) {
        rates[2][i] = turned[2][i];
    }
}

/* Turns count columns of forces and moments in the body's axes into generalised forces of position and of the
 * attitude, roll, pitch and yaw (rad). The result is [R F; E^T M], where E (d roll, d pitch, d yaw) is the angular
 * velocity in the body's axes. */
static MAYBE_UNUSED void online_turn_to_world(const real *attitude, int count, real *restrict wrench)
{
    real turned[3][3] = {{0}};
    real rates[3][3] = {{0}};
    online_write_world_axes(attitude, turned, rates);
    for (int j = 0; j < count; ++j) {
        real f[3] = {wrench[j], wrench[count + j], wrench[2 * count + j]};
        real m[3] = {wrench[3 * count + j], wrench[4 * count + j], wrench[5 * count + j]};
        for (int i = 0; i < 3; ++i) {
            wrench[i * count + j] = turned[i][0] * f[0] + turned[i][1] * f[1] + turned[i][2] * f[2];
            const real moment = rates[i][0] * m[0] + rates[i][1] * m[1] + rates[i][2] * m[2];
            wrench[(3 + i) * count + j] = moment;
        }
    }
}

/* Writes a stage's latent input u_r + C_p v and the latent state at its end x_r + sigma x of a solution. */
static MAYBE_UNUSED void online_unscale(const real *root, const real *deviation, int d, const real *v, const real *x,
        real *restrict input, real *restrict end)
{
    for (int i = 0; i < d; ++i) {
        real sum = 0;
        for (int j = 0; j <= i; ++j) {
            sum += root[j * d + i] * v[j];
        }
        input[i] += sum;
    }
    for (int i = 0; i < 2 * d; ++i) {
        end[i] += deviation[i] * x[i];
    }
}

/* The largest violation of a limit by joint positions, in half ranges, or largest if that is more. */
static MAYBE_UNUSED real online_violation(const real *q, const real *lower, const real *upper, real largest)
{
    for (int i = 0; i < 12; ++i) {
        const real outside = online_greater(q[i] - upper[i], lower[i] - q[i]);
        largest = online_greater(outside / ((real)0.5 * (upper[i] - lower[i])), largest);
    }
    return largest;
}

/* Interpolates linearly between two states of the robot, or between other quantities. */
static MAYBE_UNUSED void online_write_between(const real *earlier, const real *later, real share, int count,
        real *restrict state)
{
    for (int i = 0; i < count; ++i) {
        state[i] = earlier[i] + share * (later[i] - earlier[i]);
    }
}

/* Residual of the dynamics at a reference (state, input) that goes to end, by a step next with derivatives (A
 * B) at (x, u): next + A (state - x) + B (input - u) - end. */
static MAYBE_UNUSED void online_write_defect(const real *next, const real *by, const real *x, const real *u,
        const real *state, const real *input, const real *end, int d, real *restrict defect)
{
    for (int i = 0; i < 2 * d; ++i) {
        const real *row = by + 3 * i * d;
        real sum = next[i] - end[i];
        for (int j = 0; j < 2 * d; ++j) {
            sum += row[j] * (state[j] - x[j]);
        }
        for (int j = 0; j < d; ++j) {
            sum += row[2 * d + j] * (input[j] - u[j]);
        }
        defect[i] = sum;
    }
}

/* Writes torques, N m, of a joint PD with two gains that holds a posture and, behind it, joint velocities. */
static MAYBE_UNUSED void online_write_drives(const real *gains, const real *held, const real *x, const real *dx,
        real *restrict torque)
{
    for (int i = 0; i < 12; ++i) {
        torque[i] = gains[0] * (held[i] - x[i]) + gains[1] * (held[12 + i] - dx[i]);
    }
}

/* Writes m = M [1; z; dz]. */
static MAYBE_UNUSED void online_write_expected(const real *given, const real *state, int d, real *restrict input)
{
    for (int i = 0; i < d; ++i) {
        const real *row = given + i * (1 + 2 * d);
        input[i] = row[0];
        for (int k = 0; k < 2 * d; ++k) {
            input[i] += row[1 + k] * state[k];
        }
    }
}

/* Writes the pyramid |F_x|, |F_y| <= mu F_z / √2 of a foot with its force by the leg's torques, 3 x 3 row-major. */
static MAYBE_UNUSED void online_write_foot(const real *force, real friction, real weight_n, const real *torque,
        int leg, real *restrict rows, real *restrict bounds)
{
    for (int side = 0; side < 4; ++side) {
        const real sign = side % 2 == 0 ? 1 : -1;
        real room = 0;
        for (int j = 0; j < 12; ++j) {
            rows[12 * side + j] = 0;
        }
        for (int k = 0; k < 3; ++k) {
            const real within = friction * force[6 + k] * SQRT_HALF;
            const real entry = (sign * force[3 * (side / 2) + k] - within) / weight_n;
            rows[12 * side + 3 * leg + k] = entry;
            room -= entry * torque[3 * leg + k];
        }
        bounds[side] = room;
    }
}

/* Writes L; false if a number is not finite. */
static MAYBE_UNUSED bool online_write_hessian(const real *scaled_map, int d, real *restrict hessian)
{
    for (int i = 0; i < 12; ++i) {
        for (int j = 0; j <= i; ++j) {
            real sum = i == j ? 1 : 0;
            for (int k = 0; k < d; ++k) {
                sum += scaled_map[12 * k + i] * scaled_map[12 * k + j];
            }
            hessian[12 * i + j] = sum;
        }
    }
    return online_factorise(hessian, 12);
}

/* Writes both sides of the torque limits as rows on the torques, and the room that torque leaves. */
static MAYBE_UNUSED void online_write_limits(const real *limit_nm, const real *losses_nm, const real *torque,
        real *restrict rows, real *restrict bounds)
{
    for (int number = 0; number < 24; ++number) {
        const int joint = number % 12;
        const real sign = number < 12 ? 1 : -1;
        for (int j = 0; j < 12; ++j) {
            rows[12 * number + j] = 0;
        }
        rows[12 * number + joint] = sign / limit_nm[joint];
        bounds[number] = 1 - sign * ((torque[joint] + losses_nm[joint]) / limit_nm[joint]);
    }
}

/* Writes the friction pyramid of a force with rows (mu F_z, F_x, F_y), all zero without contact, where slacks are
 * strictly inside. */
static MAYBE_UNUSED void online_write_pyramid(const real *force, const real *root, const real *input, int d,
        real *restrict rows, real *restrict bounds)
{
    real row[D] = {0};
    for (int side = 0; side < 4; ++side) {
        const int axis = (1 + side / 2) * d;
        const real sign = side % 2 == 0 ? 1 : -1;
        bool is_free = true;
        for (int j = 0; j < d; ++j) {
            row[j] = sign * force[axis + j] - SQRT_HALF * force[j];
            is_free = is_free && (row[j] <= 0 && row[j] >= 0);
        }
        const real at_reference = online_scale_row(row, root, input, d, rows + side * d);
        bounds[side] = is_free ? 1 : -at_reference;
    }
}

/* Scale of (z, dz) for a trajectory that stands still. For a position it is the change of this latent alone that
 * moves some joint by STILL_SHARE of half its range. For a velocity it is that change within STILL_TIME_S;
 * decoder has d columns. */
static MAYBE_UNUSED void online_write_still(const real *decoder, const real *lower, const real *upper, int d,
        real *restrict still)
{
    for (int i = 0; i < d; ++i) {
        real largest = 0;
        for (int joint = 0; joint < 12; ++joint) {
            const real share = solver_magnitude(decoder[joint * d + i]) / ((real)0.5 * (upper[joint] - lower[joint]));
            largest = online_greater(share, largest);
        }
        still[i] = largest > 0 ? ONLINE_STILL_SHARE / largest : 1;
        still[d + i] = still[i] / ONLINE_STILL_TIME_S;
    }
}

/* Writes the torques, N m, with which a leg at a state of the robot presses on the ground with a vertical force. They
 * are the force times minus the gradient of the foot's height. */
static MAYBE_UNUSED void online_write_support(const online_leg_shape *leg, const real *hip, const real *x,
        const real *q, real force, real *restrict torque)
{
    real turned[3] = {q[0], q[1], q[2]};
    for (int i = 0; i < 3; ++i) {
        turned[i] = q[i] + ONLINE_SMALL_TURN;
        const real above = online_foot_height(leg, hip, x, turned);
        turned[i] = q[i] - ONLINE_SMALL_TURN;
        const real below = online_foot_height(leg, hip, x, turned);
        turned[i] = q[i];
        torque[i] = -force * (above - below) / (2 * ONLINE_SMALL_TURN);
    }
}

/* Writes m + C y. */
static MAYBE_UNUSED void online_write_torque(const real *mean, const real *deviation, const real *y,
        real *restrict torque)
{
    for (int i = 0; i < 12; ++i) {
        torque[i] = mean[i];
        for (int j = i; j < 12; ++j) {
            torque[i] += deviation[12 * i + j] * y[j];
        }
    }
}

/* Writes the rotation R_y(pitch) R_x(roll) from the body frame to an upright frame with the same heading. */
static MAYBE_UNUSED void online_write_upright(const real *attitude, real rotation[restrict 3][3])
{
    const real sr = SIN(attitude[0]);
    const real cr = COS(attitude[0]);
    const real sp = SIN(attitude[1]);
    const real cp = COS(attitude[1]);
    real rows[3][3] = {{cp, sp * sr, sp * cr}, {0, cr, -sr}, {-sp, cp * sr, cp * cr}};
    memcpy(rotation, rows, sizeof(real[3][3]));
}

/* Writes weights of squared deviations of positions and velocities in units of deviation: one, and of velocities
 * weight where these have the units of the positions. */
static MAYBE_UNUSED void online_write_weights(const real *deviation, real weight, int d, real *restrict weights)
{
    for (int i = 0; i < d; ++i) {
        const real ratio = deviation[d + i] / deviation[i];
        weights[i] = 1;
        weights[d + i] = weight * (ratio * ratio);
    }
}

/* Writes force and moment on the body by each torque of a leg into its columns of a matrix of twelve; false if the leg
 * has no force map. The angles must be finite. */
static MAYBE_UNUSED bool online_write_wrench_map(const online_leg_shape *leg, const real *hip, const real *q,
        real *restrict out)
{
    real map[3][3] = {{0}};
    real arm[3] = {0};
    if (!online_write_force_map(leg, q, false, map, arm)) {
        return false;
    }
    for (int j = 0; j < 3; ++j) {
        real force[3] = {map[0][j], map[1][j], map[2][j]};
        real moment[3] = {0};
        online_write_moment(hip, arm, force, moment);
        for (int i = 0; i < 3; ++i) {
            out[12 * i + j] = force[i];
            out[12 * (3 + i) + j] = moment[i];
        }
    }
    return true;
}

/* Raises the floor to the height, m, of a foot that the reference has on the ground. */
static MAYBE_UNUSED void online_contacts_raise_floor(online_contacts *self, bool is_first, real height)
{
    self->floor_m = is_first ? height : online_greater(height, self->floor_m);
}

/* Writes F(x, u) and (A B), row by row, for a stage of step_s. The memory holds two states, two matrices of
 * the size of (A B) and the entries of a Jacobian. */
static MAYBE_UNUSED void online_latent_dynamics_step(online_latent_dynamics *restrict self, int phase, const real *x,
        const real *u, int d, real step_s, real *restrict next, real *restrict by, real *restrict memory)
{
    const int width = 3 * d;
    real *state = memory;
    real *rest = memory + 2 * d;
    real *slope = rest;
    real *others = rest + 2 * d;
    real *sensitivity = others;
    real *last = others + 2 * d * width;
    real *slope_sensitivity = last;
    real *entries = last + 2 * d * width;
    for (int i = 0; i < 2 * d; ++i) {
        slope[i] = 0;
        next[i] = 0;
    }
    for (int i = 0; i < 2 * d * width; ++i) {
        slope_sensitivity[i] = 0;
        by[i] = 0;
    }
    for (int node = 0; node < 4; ++node) {
        const real scale = ONLINE_NODES[node] * step_s;
        for (int i = 0; i < 2 * d; ++i) {
            state[i] = x[i] + scale * slope[i];
        }
        for (int i = 0; i < 2 * d * width; ++i) {
            sensitivity[i] = scale * slope_sensitivity[i];
        }
        for (int i = 0; i < 2 * d; ++i) {
            sensitivity[i * width + i] += 1;
        }
        for (int i = 0; i < d; ++i) {
            slope[i] = state[d + i];
        }
        const int count = online_latent_dynamics_accelerate(self, phase, state, state + d, u, slope + d, entries);
        for (int i = 0; i < d * width; ++i) {
            slope_sensitivity[i] = sensitivity[d * width + i];
            slope_sensitivity[d * width + i] = 0;
        }
        for (int entry = 0; entry < count; ++entry) {
            const int row = (d + online_latent_dynamics_row(self, phase, entry)) * width;
            const int column = online_latent_dynamics_column(self, phase, entry);
            if (column < 2 * d) {
                const real *by_column = sensitivity + column * width;
                online_add_scaled(entries[entry], by_column, width, slope_sensitivity + row);
            } else {
                slope_sensitivity[row + column] += entries[entry];
            }
        }
        online_add_scaled(ONLINE_WEIGHTS[node], slope, 2 * d, next);
        online_add_scaled(ONLINE_WEIGHTS[node], slope_sensitivity, 2 * d * width, by);
    }
    for (int i = 0; i < 2 * d; ++i) {
        next[i] = x[i] + step_s * next[i];
    }
    for (int i = 0; i < 2 * d * width; ++i) {
        by[i] *= step_s;
    }
    for (int i = 0; i < 2 * d; ++i) {
        by[i * width + i] += 1;
    }
}

/* Writes ∂ddz/∂u, row by row, of so many entries. */
static MAYBE_UNUSED void online_latent_dynamics_write_gain(online_latent_dynamics *self, int phase, int count,
        const real *entries, int d, real *restrict gain)
{
    for (int i = 0; i < d * d; ++i) {
        gain[i] = 0;
    }
    for (int entry = 0; entry < count; ++entry) {
        const int column = online_latent_dynamics_column(self, phase, entry);
        if (column >= 2 * d) {
            gain[online_latent_dynamics_row(self, phase, entry) * d + column - 2 * d] = entries[entry];
        }
    }
}

/* Stores the joint velocities of a measurement if all its numbers are finite and plausible; returns whether they
 * are. */
static MAYBE_UNUSED bool online_memory_accepts(online_memory *restrict self, double time_s, const real *x,
        const real *dx)
{
    bool is_accepted = is_finite_double(time_s);
    for (int i = 0; i < 18; ++i) {
        is_accepted = is_accepted && solver_magnitude(x[i]) <= ONLINE_LARGEST_MEASURED
                && solver_magnitude(dx[i]) <= ONLINE_LARGEST_MEASURED;
    }
    for (int i = 0; i < 12; ++i) {
        self->joint_velocity[i] = is_accepted ? dx[i] : 0;
    }
    return is_accepted;
}

/* Time since the last command, at most one stage, and one stage where it is not known or the clock stands still. */
static MAYBE_UNUSED double online_memory_since_command(online_memory *self, double time_s, double step_s)
{
    const double passed_s = time_s - self->command_s;
    const bool is_known = self->has_command && passed_s > 0.0 && passed_s <= step_s;
    return is_known ? passed_s : step_s;
}

/* Writes a hold: the last posture, or the middle of the joint ranges if there is none, and fading torques with
 * damping. */
static MAYBE_UNUSED void online_memory_hold(online_memory *restrict self, const online_fallback_settings *fallback,
        double time_s, double step_s, const real *limit, const real *lower, const real *upper, real *restrict torque,
        real *restrict joints)
{
    const real fade = EXP(-(real)online_memory_since_command(self, time_s, step_s) / fallback->torque_decay_s);
    for (int i = 0; i < 12; ++i) {
        self->feed_forward_nm[i] *= fade;
        const real damping = fallback->damping_nm_s * self->joint_velocity[i];
        torque[i] = online_clamped_torque(self->feed_forward_nm[i] - damping, limit[i]);
        const real kept = self->joint_position[i];
        const real middle = (real)0.5 * (lower[i] + upper[i]);
        joints[i] = self->has_position ? kept : middle;
    }
}

/* The nearest position within the limits; the lower limit for NaN. */
static MAYBE_UNUSED real online_clamped_joint(real position, real lower, real upper)
{
    return online_smaller(online_greater(position, lower), upper);
}

/* Stores the commanded joint positions (rad), clamped to the joint limits. */
static MAYBE_UNUSED void online_memory_keep_posture(online_memory *restrict self, const real *joints,
        const real *lower, const real *upper)
{
    for (int i = 0; i < 12; ++i) {
        self->joint_position[i] = online_clamped_joint(joints[i], lower[i], upper[i]);
    }
    self->has_position = true;
}

/* A time, or where it is not known that of the last command, if there was one, and one stage. */
static MAYBE_UNUSED double online_memory_now_s(online_memory *self, double time_s, double step_s)
{
    const double next_s = self->command_s + step_s;
    const bool is_known = is_finite_double(time_s) || !self->has_command;
    return is_known ? time_s : next_s;
}

/* Keeps the time of a command and awaits the next measurement. */
static MAYBE_UNUSED void online_memory_keep_time(online_memory *self, double time_s, double step_s)
{
    self->command_s = online_memory_now_s(self, time_s, step_s);
    self->has_command = is_finite_double(self->command_s);
    memset(self->joint_velocity, 0, sizeof(real[12]));
}

/* Stores a share of the commanded torques (N m), within the motors' limits. */
static MAYBE_UNUSED void online_memory_keep_torque(online_memory *restrict self, const real *torque, real share,
        const real *limit)
{
    for (int i = 0; i < 12; ++i) {
        self->feed_forward_nm[i] = online_clamped_torque(share * torque[i], limit[i]);
    }
}

/* Whether a measurement is not believed: it jumps, and few did before. Its velocities must not become torques. */
static MAYBE_UNUSED bool online_memory_refuses(online_memory *self, bool is_jump, int patience)
{
    if (!is_jump || self->disbelieved >= patience) {
        self->disbelieved = 0;
        return false;
    }
    self->disbelieved += 1;
    memset(self->joint_velocity, 0, sizeof(real[12]));
    return true;
}

/* Stages that have passed at a time; -1 without a plan. */
static MAYBE_UNUSED double online_plan_time_passed(online_plan_time *self, double time_s)
{
    const double passed = (time_s - self->start_s) / self->step_s;
    return self->is_made ? passed : -1.0;
}

/* Whether a measured state differs from the planned one, interpolated to its time, by more than most standard
 * deviations in any coordinate. False outside the plan. */
static MAYBE_UNUSED bool online_plan_time_is_jump(online_plan_time *self, double time_s, const real *states,
        int horizon, const real *measured, const real *deviation, int d, real most)
{
    const double passed = online_plan_time_passed(self, time_s);
    if (!(passed >= 0.0 && passed <= (double)horizon)) {
        return false;
    }
    const int whole = (int)passed;
    const int before = whole < horizon ? whole : horizon - 1;
    const real share = (real)(passed - (double)before);
    real largest = 0;
    for (int i = 0; i < 2 * d; ++i) {
        const real start = states[2 * d * before + i];
        const real predicted = start + share * (states[2 * d * (before + 1) + i] - start);
        const real change = (measured[i] - predicted) / deviation[i];
        largest = online_greater(solver_magnitude(change), largest);
    }
    return largest > most;
}

/* The instant whose posture is commanded at a time for held_s, s. */
static MAYBE_UNUSED double online_plan_time_posture_s(online_plan_time *self, double now_s, double held_s)
{
    return now_s + (ONLINE_POSTURE_LEAD * self->step_s + 0.5 * held_s);
}

/* Whether a time is in a stage or beyond the last. Times up to half a stage before the first count as the first,
 * because clocks jitter. */
static MAYBE_UNUSED bool online_plan_time_reaches(online_plan_time *self, double time_s)
{
    return online_plan_time_passed(self, time_s) > -0.5;
}

/* The stage at a time, among the stages before otherwise; otherwise for a time outside these stages or without
 * a plan. Pass the last stage to use it for all later times, or the number of stages to detect that there is no
 * stage. */
static MAYBE_UNUSED int online_plan_time_stage_at(online_plan_time *self, double time_s, int otherwise)
{
    /* A time that is a stage's beginning but for rounding belongs to that stage. */
    const double passed = online_plan_time_passed(self, time_s) + 1e-6;
    return !online_plan_time_reaches(self, time_s)
            || passed >= (double)otherwise ? otherwise : passed > 0.0 ? (int)passed : 0;
}

/* Beginning of a stage, s. */
static MAYBE_UNUSED double online_plan_time_stage_s(online_plan_time *self, int stage)
{
    return self->start_s + (double)stage * self->step_s;
}

/* Whether a motion that is done has left the body still on four feet for long enough. */
static MAYBE_UNUSED bool online_routine_rests(online_routine *restrict self, const online_timing *timing,
        double time_s, bool is_done, const real *dx, bool *is_down)
{
    bool is_still = is_done;
    for (int foot = 0; foot < 4; ++foot) {
        is_still = is_still && is_down[foot];
    }
    for (int i = 12; i < 15; ++i) {
        is_still = is_still && solver_magnitude(dx[i]) < ONLINE_STILL_M_S;
    }
    if (is_still && !self->is_still) {
        self->still_s = time_s;
    }
    self->is_still = is_still;
    return is_still && time_s - self->still_s >= timing->settle_s;
}

/* The mode after a measurement of a robot that follows the reference, which may be over. */
static MAYBE_UNUSED online_mode online_routine_after_jump(online_routine *restrict self, const online_timing *timing,
        double time_s, bool is_over, const real *dx, bool *is_down)
{
    int down = 0;
    for (int foot = 0; foot < 4; ++foot) {
        if (is_down[foot]) {
            down += 1;
        }
    }
    self->has_flown = self->has_flown || down == 0;
    const bool has_landed = is_over || (self->has_flown && down > 0);
    if (self->mode == ONLINE_JUMP && has_landed) {
        self->mode = ONLINE_LAND;
    }
    const bool is_done = self->mode == ONLINE_LAND && is_over;
    return online_routine_rests(self, timing, time_s, is_done, dx, is_down) ? ONLINE_RECOVER : self->mode;
}

/* The mode after a measurement of joints that move to the stand: Mode::Ready when they are there,
 * Mode::Damp if they do not arrive. */
static MAYBE_UNUSED online_mode online_routine_after_standing(online_routine *restrict self,
        const online_bounds *bounds, const online_timing *timing, double time_s, const real *x, const real *dx,
        bool *is_down)
{
    const double passed_s = time_s - self->since_s;
    bool is_there = passed_s >= timing->stand_s;
    for (int i = 0; i < 12; ++i) {
        const real off = solver_magnitude(x[i] - self->stand[i]);
        is_there = is_there && off <= ONLINE_NEAR * bounds->posture_rad;
    }
    const bool rests = online_routine_rests(self, timing, time_s, is_there, dx, is_down);
    if (self->mode == ONLINE_READY) {
        return self->mode;
    }
    if (rests) {
        return ONLINE_READY;
    }
    return passed_s > ONLINE_LATEST * timing->stand_s ? ONLINE_DAMP : self->mode;
}

/* Begins a mode at a time, from a posture. */
static MAYBE_UNUSED void online_routine_enter(online_routine *restrict self, online_mode mode, double time_s,
        const real *joints)
{
    self->mode = mode;
    self->is_asked = false;
    self->asks_walk = false;
    self->since_s = time_s;
    self->is_still = false;
    for (int i = 0; i < 12; ++i) {
        self->from[i] = joints[i];
    }
}

/* Begins a jump or a walk: the reference starts now, where the robot stands and looks. */
static MAYBE_UNUSED void online_routine_leap(online_routine *restrict self, online_mode mode, double time_s,
        double start_s, const real *x, const real *start)
{
    online_routine_enter(self, mode, time_s, x);
    self->has_flown = false;
    self->offset_s = time_s - start_s;
    self->yaw = start[17] - x[17];
    self->cosine = COS(self->yaw);
    self->sine = SIN(self->yaw);
    for (int i = 0; i < 12; ++i) {
        self->stand[i] = start[i];
    }
    for (int i = 0; i < 2; ++i) {
        self->place[i] = x[12 + i];
        self->start[i] = start[12 + i];
    }
}

/* Writes a state and its velocity in the frame of the reference. */
static MAYBE_UNUSED void online_routine_write_in_frame(online_routine *self, const real *x, const real *dx,
        real *restrict framed_x, real *restrict framed_dx)
{
    for (int i = 0; i < 18; ++i) {
        framed_x[i] = x[i];
        framed_dx[i] = dx[i];
    }
    const real along = x[12] - self->place[0];
    const real aside = x[13] - self->place[1];
    framed_x[12] = self->start[0] + self->cosine * along - self->sine * aside;
    framed_x[13] = self->start[1] + self->sine * along + self->cosine * aside;
    framed_x[17] = x[17] + self->yaw;
    framed_dx[12] = self->cosine * dx[12] - self->sine * dx[13];
    framed_dx[13] = self->sine * dx[12] + self->cosine * dx[13];
}

/* Writes where the joints should be at a time, rad, and how fast they should move, rad/s; the share of the weight
 * that they carry. */
static MAYBE_UNUSED real online_routine_write_posture(online_routine *self, const online_timing *timing,
        double time_s, real *restrict joints, real *restrict velocity)
{
    const bool moves = self->mode == ONLINE_STAND_UP || self->mode == ONLINE_RECOVER;
    const real passed = (real)((time_s - self->since_s) / timing->stand_s);
    const real begun = passed > 0 ? online_smaller(passed, 1) : 0;
    const real done = moves ? begun : 1;
    const real share = done * done * (3 - 2 * done);
    const real rate = 6 * done * (1 - done) / (real)timing->stand_s;
    for (int i = 0; i < 12; ++i) {
        const real way = self->stand[i] - self->from[i];
        joints[i] = self->from[i] + share * way;
        velocity[i] = rate * way;
    }
    return self->mode == ONLINE_STAND_UP ? share : 1;
}

static MAYBE_UNUSED online_share online_share_unknown(void)
{
    return (online_share){.estimate = 1, .weight = 0, .weighted = 0, .unit = 0};
}

/* Updates the estimate from a measurement at passed stages into the plan, up to 1.1. states are the states at
 * the beginning and end of the first stage, input is its input. at_command and drives are the latent inputs
 * of the joint PD at the command and now. */
static MAYBE_UNUSED void online_share_update(online_share *restrict self, double passed, real step_s,
        real time_constant_s, const real *by_input, const real *input, const real *states, const real *measured,
        const real *deviation, const real *at_command, const real *drives, int d)
{
    if (!(passed > 0.0 && passed < 1.1)) {
        return;
    }
    const real part = (real)passed;
    real size = 0;
    real agreement = 0;
    for (int i = 0; i < d; ++i) {
        real by_plan = 0;
        real by_drives = 0;
        for (int k = 0; k < d; ++k) {
            const real effect = part * by_input[i * d + k] / deviation[d + i];
            by_plan += effect * input[k];
            by_drives += effect * ((real)0.5 * (at_command[k] + drives[k]));
        }
        const real start = states[d + i];
        const real planned = start + part * (states[3 * d + i] - start);
        const real missed = (measured[d + i] - planned) / deviation[d + i] - by_drives;
        const real change = by_plan + by_drives;
        size += change * change;
        agreement += change * missed;
    }
    if (!(size > 0 && solver_is_finite_number(size) && solver_is_finite_number(agreement))) {
        return;
    }
    const real unit = (self->unit <= 0 && self->unit >= 0) ? size : self->unit;
    const real own = online_smaller(size / unit, ONLINE_LARGEST_WEIGHT);
    const real kept = EXP(-part * step_s / time_constant_s);
    const real weight = kept * self->weight + own;
    const real weighted = kept * self->weighted + own * self->estimate * (1 + agreement / size);
    const real mean = (ONLINE_PRIOR_WEIGHT + weighted) / (ONLINE_PRIOR_WEIGHT + weight);
    /* The quotient of a large and a tiny number may be infinite: such a step is ignored. */
    if (solver_is_finite_number(mean)) {
        self->unit = unit;
        self->weight = weight;
        self->weighted = weighted;
        self->estimate = online_greater(ONLINE_LEAST, online_smaller(mean, ONLINE_LARGEST));
    }
}

/* Writes torques that fade from the last ones into the damping of joint velocities, and a posture that fades into
 * the measured one. Returns the remaining share of the joint PD. passed_s is the time since the last command. */
static MAYBE_UNUSED real online_supervisor_fade(online_supervisor *restrict self, const online_bounds *bounds,
        real damping, double passed_s, const real *joints, const real *velocity, const real *limit,
        const real *lower, const real *upper, const real *last_torque, const real *last_posture,
        real *restrict torque, real *restrict posture)
{
    const real passed = (real)(self->faded_s / bounds->fade_s);
    const real share = passed < 1 ? 1 - passed : 0;
    self->faded_s += passed_s;
    for (int i = 0; i < 12; ++i) {
        const real damped = online_clamped_torque(-damping * velocity[i], bounds->damping_torque_nm);
        const real faded = share * last_torque[i] + (1 - share) * damped;
        torque[i] = online_clamped_torque(faded, limit[i]);
        const real moved = share * last_posture[i] + (1 - share) * joints[i];
        posture[i] = online_clamped_joint(moved, lower[i], upper[i]);
    }
    return share;
}

/* Forgets measurements, but not the floor. */
static MAYBE_UNUSED void online_contacts_forget(online_contacts *self)
{
    self->is_aloft = false;
    self->is_contradicted = false;
    self->is_opposed = false;
}

/* Forgets measurements, but neither a fault nor the floor. */
static MAYBE_UNUSED void online_supervisor_forget(online_supervisor *self)
{
    if (self->fault == ONLINE_NONE) {
        self->faded_s = 0.0;
    }
    self->has_time = false;
    self->standing = 0;
    self->frozen = 0;
    self->has_good = false;
    self->is_doubted = false;
    online_contacts_forget(&self->contacts);
    self->poor_s = 0.0;
    for (int i = 0; i < 3; ++i) {
        self->unexplained[i] = 0;
    }
}

/* Adds up the time of steps without a good plan, passed_s after the last one; returns the fault. */
static MAYBE_UNUSED online_fault online_supervisor_judge(online_supervisor *restrict self,
        const online_bounds *bounds, bool is_poor, double passed_s)
{
    self->poor_s = is_poor ? self->poor_s + passed_s : 0.0;
    const double most = (double)bounds->poor_steps;
    const bool is_counted = most > 0.0 && self->fault == ONLINE_NONE;
    if (is_counted && self->poor_s / self->step_s > most - 0.5) {
        self->fault = ONLINE_POOR_STEPS;
    }
    return self->fault;
}

/* Forgets measurements and the fault. */
static MAYBE_UNUSED void online_supervisor_reset(online_supervisor *self)
{
    online_supervisor_forget(self);
    self->fault = ONLINE_NONE;
    self->faded_s = 0.0;
}

/* Whether the clock stands, goes back or leaps. */
static MAYBE_UNUSED online_fault online_supervisor_clock_fault(online_supervisor *restrict self,
        const online_bounds *bounds, double time_s)
{
    const double passed_s = time_s - self->time_s;
    const bool is_first = !self->has_time;
    const bool is_later = is_first || passed_s > 0.0;
    self->standing = is_later ? 0 : self->standing + 1;
    if (is_later) {
        self->time_s = time_s;
    }
    self->has_time = true;
    if (is_first || bounds->clock_gap_s > 1e9) {
        return ONLINE_NONE;
    }
    if (passed_s > bounds->clock_gap_s && passed_s > ONLINE_LONGEST_STEPS * self->step_s) {
        return ONLINE_CLOCK_LEAPS;
    }
    if (passed_s < -ONLINE_CLOCK_JITTER_S) {
        return ONLINE_CLOCK_BACK;
    }
    const bool is_counted = bounds->frozen_steps > 0;
    if (is_counted && self->standing >= bounds->frozen_steps) {
        return ONLINE_CLOCK_STANDS;
    }
    return ONLINE_NONE;
}

/* Whether a measurement was the same too often: one that moves, or while the reference does. */
static MAYBE_UNUSED bool online_supervisor_is_frozen(online_supervisor *restrict self, const online_bounds *bounds,
        const real *x, const real *dx, const real *nominal)
{
    bool is_same = true;
    bool moves = false;
    for (int i = 0; i < 18; ++i) {
        is_same = is_same && (x[i] <= self->seen_x[i] && x[i] >= self->seen_x[i]) && (dx[i] <= self->seen_dx[i]
                && dx[i] >= self->seen_dx[i]);
        const real moved = solver_magnitude(nominal[i] - self->nominal[i]);
        moves = (moves || !(dx[i] <= 0 && dx[i] >= 0)) || moved > ONLINE_REFERENCE_MOVES;
    }
    for (int i = 0; i < 18; ++i) {
        self->seen_x[i] = x[i];
        self->seen_dx[i] = dx[i];
        if (!is_same) {
            self->nominal[i] = nominal[i];
        }
    }
    self->frozen = is_same ? self->frozen + 1 : 0;
    return bounds->frozen_steps > 0 && moves && self->frozen >= bounds->frozen_steps;
}

/* Cosine of the angle between the verticals of two attitudes, each roll and pitch, rad. */
static MAYBE_UNUSED real online_common_height(const real *attitude, const real *other)
{
    const real turned = COS(attitude[1]) * COS(other[1]);
    const real along = SIN(attitude[1]) * SIN(other[1]);
    const real aside = turned * (SIN(attitude[0]) * SIN(other[0]));
    const real above = turned * (COS(attitude[0]) * COS(other[0]));
    return along + aside + above;
}

static MAYBE_UNUSED real online_distance(const real *place, const real *other)
{
    const real x = place[0] - other[0];
    const real y = place[1] - other[1];
    const real z = place[2] - other[2];
    return SQRT(x * x + y * y + z * z);
}

/* Whether a state leaps from its prediction, a time after the last good measurement. */
static MAYBE_UNUSED online_fault online_supervisor_leap(online_supervisor *self, const online_bounds *bounds,
        double passed_s, const real *x, const real *dx)
{
    if (passed_s > bounds->clock_gap_s) {
        return ONLINE_NONE;
    }
    const real passed = (real)passed_s;
    real by_last[3] = {0};
    real by_mean[3] = {0};
    for (int i = 0; i < 3; ++i) {
        const real mean = (real)0.5 * (self->good_dx[12 + i] + dx[12 + i]);
        by_last[i] = self->good_x[12 + i] + passed * self->good_dx[12 + i];
        by_mean[i] = self->good_x[12 + i] + passed * mean;
    }
    const real off = online_smaller(online_distance(x + 12, by_last), online_distance(x + 12, by_mean));
    if (off > ONLINE_NEAR * bounds->distance_m) {
        return ONLINE_BODY_LEAP;
    }
    for (int i = 0; i < 12; ++i) {
        const real moved = x[i] - self->good_x[i];
        const real from_last = solver_magnitude(moved - passed * self->good_dx[i]);
        const real from_mean = solver_magnitude(moved - (real)0.5 * passed * (self->good_dx[i] + dx[i]));
        if (online_smaller(from_last, from_mean) > ONLINE_NEAR * bounds->posture_rad) {
            return ONLINE_JOINTS_LEAP;
        }
    }
    return ONLINE_NONE;
}

/* The first bound that a state is beyond. */
static MAYBE_UNUSED online_fault online_supervisor_state_fault(online_supervisor *self, const online_bounds *bounds,
        double time_s, const real *x, const real *dx, const real *nominal, const real *lower, const real *upper,
        const real *speed)
{
    if (bounds->tilt_rad < ONLINE_HALF_TURN) {
        const real along = online_common_height(x + 15, nominal + 15);
        const real upright = COS(x[16]) * COS(x[15]);
        if (along < COS(bounds->tilt_rad) || upright < -ONLINE_UPSIDE_DOWN) {
            return ONLINE_TILT;
        }
    }
    real joints = 0;
    for (int i = 0; i < 12; ++i) {
        const real margin = bounds->joint_margin_rad;
        if (x[i] > upper[i] + margin || x[i] < lower[i] - margin) {
            return ONLINE_JOINT_BEYOND;
        }
        if (solver_magnitude(dx[i]) > bounds->joint_velocity * speed[i]) {
            return ONLINE_JOINT_SPEED;
        }
        joints = online_greater(solver_magnitude(x[i] - nominal[i]), joints);
    }
    real by_reference[3] = {nominal[12], nominal[13], nominal[14]};
    const real off = online_distance(x + 12, by_reference);
    if (off > bounds->distance_m) {
        return ONLINE_BODY_FAR;
    }
    if (joints > bounds->posture_rad) {
        return ONLINE_JOINTS_FAR;
    }
    const bool is_near = off <= ONLINE_NEAR * bounds->distance_m && joints <= ONLINE_NEAR * bounds->posture_rad;
    if (!self->has_good && !is_near) {
        return ONLINE_NOT_AT_START;
    }
    return self->has_good ? online_supervisor_leap(self, bounds, time_s - self->good_s, x, dx) : ONLINE_NONE;
}

/* Whether the body's velocity contradicts its positions since the last good measurement. */
static MAYBE_UNUSED bool online_supervisor_is_unexplained(online_supervisor *restrict self,
        const online_bounds *bounds, double time_s, const real *x, const real *dx)
{
    const real passed = (real)(time_s - self->good_s);
    if (!self->has_good || passed <= 0) {
        return false;
    }
    const real share = passed / ONLINE_MEMORY_S;
    const real kept = share < 1 ? 1 - share : 0;
    real largest = 0;
    for (int i = 0; i < 3; ++i) {
        const real moved = x[12 + i] - self->good_x[12 + i];
        const real by_velocity = (real)0.5 * (dx[12 + i] + self->good_dx[12 + i]) * passed;
        const real unexplained = kept * self->unexplained[i] + (moved - by_velocity);
        self->unexplained[i] = unexplained;
        largest = online_greater(solver_magnitude(unexplained), largest);
    }
    return largest / ONLINE_MEMORY_S > bounds->velocity_mismatch;
}

/* Whether contacts have been impossible for too long: a foot on the ground is above the floor, or a body without a
 * foot on the ground does not fall. */
static MAYBE_UNUSED bool online_contacts_contradicts(online_contacts *restrict self, int most_steps, double time_s,
        double step_s, real rises, const real *heights, bool *is_down)
{
    bool is_wrong = false;
    bool is_aloft = true;
    for (int foot = 0; foot < 4; ++foot) {
        const bool is_up = heights[foot] > self->floor_m + ONLINE_FOOT_UP_M;
        is_wrong = is_wrong || (is_down[foot] && is_up);
        is_aloft = is_aloft && !is_down[foot];
    }
    if (is_aloft && !self->is_aloft) {
        self->aloft_s = time_s;
        self->aloft_m_s = rises;
    }
    self->is_aloft = is_aloft;
    const double passed_s = time_s - self->aloft_s;
    const real least = ONLINE_FALL_SHARE * (real)ONLINE_GRAVITY_M_S2 * (real)passed_s;
    const bool falls = rises - self->aloft_m_s < -least;
    if (is_aloft && passed_s > ONLINE_FALL_S && !falls) {
        is_wrong = true;
    }
    if (is_wrong && !self->is_contradicted) {
        self->contradicted_s = time_s;
    }
    self->is_contradicted = is_wrong;
    const double steps = 1.0 + (time_s - self->contradicted_s) / step_s;
    const double most = (double)most_steps;
    return is_wrong && most > 0.0 && steps > most - 0.5;
}

/* Whether a walk has for too long been on just the other feet than measured. */
static MAYBE_UNUSED bool online_contacts_opposes(online_contacts *restrict self, int most_steps, double time_s,
        bool *is_down, bool *walks_on)
{
    bool is_opposed = true;
    bool changes = false;
    for (int foot = 0; foot < 4; ++foot) {
        is_opposed = is_opposed && is_down[foot] != walks_on[foot];
        changes = changes || walks_on[foot] != walks_on[0];
    }
    is_opposed = is_opposed && changes;
    if (is_opposed && !self->is_opposed) {
        self->opposed_s = time_s;
    }
    self->is_opposed = is_opposed;
    return is_opposed && most_steps > 0 && time_s - self->opposed_s > ONLINE_OPPOSED_S;
}

/* Whether contacts have been impossible for most_steps steps, which disable the check if they are zero. The body
 * rises at rises, m/s; heights are those of the feet, m, is_down the measured feet on the ground, walks_on
 * those that a walk has there. */
static MAYBE_UNUSED bool online_contacts_are_impossible(online_contacts *restrict self, int most_steps,
        double time_s, double step_s, real rises, const real *heights, bool *is_down, bool *walks_on)
{
    return online_contacts_contradicts(self, most_steps, time_s, step_s, rises, heights, is_down)
            || online_contacts_opposes(self, most_steps, time_s, is_down, walks_on);
}

/* Checks a finite measurement of state and velocity, 18 each, and returns the fault. nominal is the reference's
 * state, heights those of the feet (m), is_down the feet on the ground. walks_on are the feet that a walk
 * has on the ground, for other references the measured ones. */
static MAYBE_UNUSED online_fault online_supervisor_watch(online_supervisor *restrict self,
        const online_bounds *bounds, double time_s, const real *x, const real *dx, const real *nominal,
        const real *heights, bool *is_down, bool *walks_on, const real *lower, const real *upper, const real *speed)
{
    if (self->fault != ONLINE_NONE) {
        return self->fault;
    }
    const bool is_first = !self->has_time;
    self->fault = online_supervisor_clock_fault(self, bounds, time_s);
    if (self->fault == ONLINE_NONE && online_supervisor_is_frozen(self, bounds, x, dx, nominal)) {
        self->fault = ONLINE_FROZEN;
    }
    if (self->fault != ONLINE_NONE) {
        return self->fault;
    }
    online_fault state = online_supervisor_state_fault(self, bounds, time_s, x, dx, nominal, lower, upper, speed);
    if (state != ONLINE_NONE) {
        const bool is_far = state == ONLINE_BODY_FAR || state == ONLINE_JOINTS_FAR;
        if (!self->is_doubted) {
            self->doubted_s = time_s;
        }
        self->is_doubted = true;
        if (is_first) {
            self->fault = is_far ? ONLINE_NOT_AT_START : state;
        } else if (time_s - self->doubted_s >= ONLINE_PATIENCE_S) {
            self->fault = state;
        }
        return self->fault;
    }
    self->is_doubted = false;
    if (online_supervisor_is_unexplained(self, bounds, time_s, x, dx)) {
        self->fault = ONLINE_VELOCITY_MISMATCH;
    } else if (online_contacts_are_impossible(&self->contacts, bounds->contact_mismatch_steps, time_s, self->step_s,
            dx[14], heights, is_down, walks_on)) {
        self->fault = ONLINE_CONTACT_MISMATCH;
    }
    self->has_good = true;
    self->good_s = time_s;
    for (int i = 0; i < 18; ++i) {
        self->good_x[i] = x[i];
        self->good_dx[i] = dx[i];
    }
    return self->fault;
}

/* Whether a state within STATE_REACH standard deviations of some state of the trajectory reaches row . z =
 * bound. */
static MAYBE_UNUSED bool online_trajectory_comes_near(online_trajectory *self, const real *row, real bound,
        const real *deviation)
{
    const int d = online_trajectory_latent_dim(self);
    real z[D] = {0};
    real spread = 0;
    real farthest = 0;
    for (int i = 0; i < d; ++i) {
        spread += row[i] * deviation[i] * (row[i] * deviation[i]);
    }
    for (int sample = 0; sample < online_trajectory_count(self); ++sample) {
        online_trajectory_write_position(self, sample, z);
        real along = 0;
        for (int i = 0; i < d; ++i) {
            along += z[i] * row[i];
        }
        const bool is_less = sample > 0 && farthest > along;
        farthest = is_less ? farthest : along;
    }
    return farthest + ONLINE_STATE_REACH * SQRT(spread) >= bound;
}

static MAYBE_UNUSED online_instant online_trajectory_locate(online_trajectory *self, double time_s)
{
    const int count = online_trajectory_count(self);
    int low = 0;
    int high = count;
    while (low < high) {
        const int middle = low + (high - low) / 2;
        /* Never so, but analysers of the C do not see it. */
        if (middle >= count) {
            break;
        }
        if (online_trajectory_time_s(self, middle) <= time_s + ONLINE_TIME_TOLERANCE_S) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    const int before = low > 0 && low <= count ? low - 1 : 0;
    double share = 0.0;
    if (before + 1 < count) {
        const double start_s = online_trajectory_time_s(self, before);
        share = (time_s - start_s) / (online_trajectory_time_s(self, before + 1) - start_s);
        share = share < 0.0 ? 0.0 : share > 1.0 ? 1.0 : share;
    }
    return (online_instant){.sample = before, .share = (real)share};
}

/* Writes the mean latent input over a time: between two samples their mean, beyond the ends the end's. */
static MAYBE_UNUSED void online_trajectory_mean_input(online_trajectory *self, double time_s, double duration_s,
        real *restrict mean)
{
    const int d = online_trajectory_latent_dim(self);
    const int last = online_trajectory_count(self) - 1;
    const double first_s = online_trajectory_time_s(self, 0);
    const double last_s = online_trajectory_time_s(self, last);
    const double end_s = time_s + duration_s;
    real input[D] = {0};
    real next[D] = {0};
    for (int i = 0; i < d; ++i) {
        mean[i] = 0;
    }
    const double before_s = (first_s < end_s ? first_s : end_s) - time_s;
    if (before_s > 0.0) {
        online_trajectory_write_input(self, 0, input);
        online_add_scaled((real)before_s, input, d, mean);
    }
    online_instant at = online_trajectory_locate(self, time_s);
    bool has_input = false;
    for (int sample = at.sample; sample < last; ++sample) {
        const double start_s = online_trajectory_time_s(self, sample);
        const double stop_s = online_trajectory_time_s(self, sample + 1);
        if (start_s >= end_s) {
            break;
        }
        const double from_s = start_s > time_s ? start_s : time_s;
        const double span_s = (stop_s < end_s ? stop_s : end_s) - from_s;
        if (span_s > 0.0) {
            const real half_s = (real)(0.5 * span_s);
            if (!has_input) {
                online_trajectory_write_input(self, sample, input);
            }
            online_trajectory_write_input(self, sample + 1, next);
            online_add_scaled(half_s, input, d, mean);
            online_add_scaled(half_s, next, d, mean);
            memcpy(input, next, sizeof(real[D]));
            has_input = true;
        }
    }
    const double after_s = end_s - (last_s > time_s ? last_s : time_s);
    if (after_s > 0.0) {
        online_trajectory_write_input(self, last, input);
        online_add_scaled((real)after_s, input, d, mean);
    }
    for (int i = 0; i < d; ++i) {
        mean[i] /= (real)duration_s;
    }
}

/* Shifts the input of a stage to the time for which a command is held. The shift is the difference of the
 * trajectory's own mean inputs over that time and over the stage. Does nothing for commands that are held for
 * whole stages. */
static MAYBE_UNUSED void online_trajectory_move_input(online_trajectory *self, double stage_s, double step_s,
        double now_s, double held_s, real *restrict input)
{
    if (held_s > ONLINE_WHOLE_STAGE * step_s) {
        return;
    }
    real held[D] = {0};
    real whole[D] = {0};
    online_trajectory_mean_input(self, now_s, held_s, held);
    online_trajectory_mean_input(self, stage_s, step_s, whole);
    for (int i = 0; i < online_trajectory_latent_dim(self); ++i) {
        input[i] += held[i] - whole[i];
    }
}

static MAYBE_UNUSED int online_trajectory_phase_at(online_trajectory *self, double time_s)
{
    online_instant at = online_trajectory_locate(self, time_s);
    return online_trajectory_phase(self, at.sample);
}

/* Writes the phases of the stages from a time on: the trajectory's, changed where the feet disagree. */
static MAYBE_UNUSED online_contact online_trajectory_schedule(online_trajectory *self, double time_s, double step_s,
        int measured, int horizon, int *restrict phases)
{
    for (int k = 0; k < horizon; ++k) {
        phases[k] = online_trajectory_phase_at(self, time_s + ((double)k + 0.5) * step_s);
    }
    if (measured == ONLINE_NO_PHASE) {
        return ONLINE_UNKNOWN;
    }
    if (measured == phases[0] || measured == online_trajectory_phase_at(self, time_s)) {
        return ONLINE_AS_SCHEDULED;
    }
    int next = horizon;
    int last = 0;
    for (int k = horizon - 1; k >= 0; --k) {
        if (phases[k] == measured) {
            next = k;
        }
        if (online_trajectory_phase_at(self, time_s - (double)(k + 1) * step_s) == measured) {
            last = k + 1;
        }
    }
    if (next < horizon && (last == 0 || next <= last)) {
        for (int k = 0; k < next; ++k) {
            phases[k] = measured;
        }
        return ONLINE_EARLY;
    }
    phases[0] = measured;
    return last > 0 ? ONLINE_LATE : ONLINE_UNKNOWN;
}

/* Writes (z, dz) of a sample. */
static MAYBE_UNUSED void online_trajectory_write_state(online_trajectory *self, int sample, real *restrict state)
{
    online_trajectory_write_position(self, sample, state);
    online_trajectory_write_velocity(self, sample, state + online_trajectory_latent_dim(self));
}

/* Writes (z, dz) at a time. */
static MAYBE_UNUSED void online_trajectory_state_at(online_trajectory *self, double time_s, real *restrict state)
{
    const int d = online_trajectory_latent_dim(self);
    const int last = online_trajectory_count(self) - 1;
    online_instant at = online_trajectory_locate(self, time_s);
    online_trajectory_write_state(self, at.sample, state);
    if (at.sample < last) {
        real later[X] = {0};
        online_trajectory_write_state(self, at.sample + 1, later);
        for (int i = 0; i < 2 * d; ++i) {
            state[i] += at.share * (later[i] - state[i]);
        }
    }
    if (time_s < online_trajectory_time_s(self, 0) || time_s > online_trajectory_time_s(self, last)) {
        for (int i = d; i < 2 * d; ++i) {
            state[i] = 0;
        }
    }
}

/* Whether a sample is in the window around another one: in its phase and near in time. */
static MAYBE_UNUSED bool online_trajectory_is_beside(online_trajectory *self, int sample, int other)
{
    const double off_s = online_trajectory_time_s(self, other) - online_trajectory_time_s(self, sample);
    return online_trajectory_phase(self, other) == online_trajectory_phase(self, sample)
            && off_s <= ONLINE_HALF_WINDOW_S && off_s >= -ONLINE_HALF_WINDOW_S;
}

/* Writes the slope of the straight line through the velocities around a sample, within its phase. */
static MAYBE_UNUSED void online_trajectory_write_acceleration(online_trajectory *self, int sample,
        real *restrict slope)
{
    const int d = online_trajectory_latent_dim(self);
    int first = sample;
    int last = sample;
    while (first > 0 && online_trajectory_is_beside(self, sample, first - 1)) {
        first -= 1;
    }
    while (last + 1 < online_trajectory_count(self) && online_trajectory_is_beside(self, sample, last + 1)) {
        last += 1;
    }
    /* A lone sample of its phase: its neighbours are all there is. */
    const bool is_lone = first == last;
    if (is_lone && first > 0) {
        first -= 1;
    }
    if (is_lone && last + 1 < online_trajectory_count(self)) {
        last += 1;
    }
    double mean_s = 0.0;
    for (int other = first; other <= last; ++other) {
        mean_s += online_trajectory_time_s(self, other);
    }
    mean_s /= (double)(last - first + 1);
    for (int i = 0; i < d; ++i) {
        slope[i] = 0;
    }
    double spread = 0.0;
    real velocity[D] = {0};
    for (int other = first; other <= last; ++other) {
        const double off_s = online_trajectory_time_s(self, other) - mean_s;
        spread += off_s * off_s;
        online_trajectory_write_velocity(self, other, velocity);
        online_add_scaled((real)off_s, velocity, d, slope);
    }
    for (int i = 0; i < d; ++i) {
        slope[i] /= (real)spread;
    }
}

/* Writes the standard deviation of each of (z, dz), never below a hundredth of the largest of its kind; still
 * if that is a motion within which the trajectory stands still. */
static MAYBE_UNUSED void online_trajectory_write_deviations(online_trajectory *self, const real *still,
        real *restrict deviation)
{
    const int d = online_trajectory_latent_dim(self);
    real mean[X] = {0};
    real state[X] = {0};
    for (int sample = 0; sample < online_trajectory_count(self); ++sample) {
        online_trajectory_write_state(self, sample, state);
        online_add_scaled(1, state, 2 * d, mean);
    }
    for (int i = 0; i < 2 * d; ++i) {
        mean[i] /= (real)online_trajectory_count(self);
        deviation[i] = 0;
    }
    for (int sample = 0; sample < online_trajectory_count(self); ++sample) {
        online_trajectory_write_state(self, sample, state);
        for (int i = 0; i < 2 * d; ++i) {
            deviation[i] += (state[i] - mean[i]) * (state[i] - mean[i]);
        }
    }
    bool is_still = true;
    for (int i = 0; i < 2 * d; ++i) {
        deviation[i] = SQRT(deviation[i] / (real)online_trajectory_count(self));
        is_still = is_still && (i >= d || deviation[i] < still[i]);
    }
    for (int half = 0; half < 2; ++half) {
        real least = 0;
        for (int i = half * d; i < (half + 1) * d; ++i) {
            least = online_greater(deviation[i], least);
        }
        const real lowest = ONLINE_DEVIATION_FLOOR * least;
        least = least > 0 ? lowest : 1;
        for (int i = half * d; i < (half + 1) * d; ++i) {
            const real own = online_greater(deviation[i], least);
            deviation[i] = is_still ? still[i] : own;
        }
    }
}

/* Replaces the scales of latent coordinates along x, y and yaw by the given ones that are positive. place
 * contains for each coordinate the displacement with each of the three (3 d), SI. */
static MAYBE_UNUSED void online_trajectory_write_place_scales(online_trajectory *self, const real *place,
        real place_m, real heading_rad, real *restrict deviation)
{
    for (int i = 0; i < online_trajectory_latent_dim(self); ++i) {
        const real path = solver_magnitude(place[3 * i]) + solver_magnitude(place[3 * i + 1]);
        const real turn = solver_magnitude(place[3 * i + 2]);
        if (place_m > 0 && path > 0) {
            deviation[i] = place_m * path;
        }
        if (heading_rad > 0 && turn > 0 && path <= 0) {
            deviation[i] = heading_rad * turn;
        }
    }
}

