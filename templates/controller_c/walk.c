/* @generated from src/control/online by `cargo run -p romc-translate`: walks.
 * Names that are defined elsewhere: real, the type of numbers; NX and NU, how many states and inputs there are. */

/* Samples of the stand that are ahead when a walk starts. */
#define WALK_AHEAD 16

/* Time that samples reach beyond the horizon, s. */
#define WALK_AHEAD_S 0.1

/* Numbers of a node: state, torques at the links and feet (18 + 18 + 4), then their changes per m/s, m/s and rad/s. */
#define WALK_NODE 160

/* Samples that stay when their time is over: a measurement may be late. */
#define WALK_PAST 16

/* Time between samples, s. */
#define WALK_SPACING_S 0.01

/* A turn, rad. */
#define WALK_TURN (real)6.283185307179586

/* Samples that a walk holds at a time. */
#define WALK_WINDOW 64

/* Moves all samples by one to the front. */
static MAYBE_UNUSED void walk_walker_shift(walk_walker *self)
{
    for (int sample = 0; sample < WALK_WINDOW - 1; ++sample) {
        self->time_s[sample] = self->time_s[sample + 1];
    }
    for (int i = 0; i < 18 * (WALK_WINDOW - 1); ++i) {
        self->x[i] = self->x[i + 18];
        self->dx[i] = self->dx[i + 18];
        self->u[i] = self->u[i + 18];
    }
    for (int i = 0; i < 4 * (WALK_WINDOW - 1); ++i) {
        self->feet[i] = self->feet[i + 4];
    }
    for (int i = 0; i < 6 * (WALK_WINDOW - 1); ++i) {
        self->path[i] = self->path[i + 6];
    }
    self->time_s[WALK_WINDOW - 1] = self->time_s[WALK_WINDOW - 2] + WALK_SPACING_S;
}

/* The smaller of two numbers; the second if the first is not one. */
static MAYBE_UNUSED real walk_smaller(real value, real other)
{
    return value < other ? value : other;
}

/* Velocity, amplitude and share of the stride of one more sample. A velocity changes at most by its range in
 * range_s. */
static MAYBE_UNUSED void walk_walker_pace(walk_walker *restrict self, const walk_gait *gait, double range_s)
{
    const real part = (real)(WALK_SPACING_S / range_s);
    bool is_slow = true;
    for (int i = 0; i < 3; ++i) {
        const real most = part * (gait->most[i] - gait->least[i]);
        const real missing = self->asked[i] - self->now[i];
        self->now[i] = missing > most ? self->now[i] + most : missing < -most ? self->now[i] - most : self->asked[i];
        is_slow = is_slow && solver_magnitude(self->now[i]) <= 0;
    }
    const real stride = (real)WALK_SPACING_S * gait->frequency_hz;
    const real had = self->amplitude;
    self->in_place = self->stops && is_slow ? self->in_place + stride : 0;
    /* A stride in place brings the feet below the hips. */
    const bool ends = self->in_place > 1;
    const real changed = ends ? had - stride : had + stride;
    const real least = changed > 0 ? changed : 0;
    self->amplitude = walk_smaller(least, 1);
    if (self->amplitude <= 0 && had > 0) {
        self->rest_s = self->time_s[WALK_WINDOW - 1];
    }
    self->share += stride;
    if (self->share >= 1) {
        self->share -= 1;
    }
    if (self->amplitude <= 0) {
        self->share = 0;
    }
}

/* The path's next place, by the velocity along the heading in the middle of the step. */
static MAYBE_UNUSED void walk_walker_move_along(walk_walker *self)
{
    const real step = (real)WALK_SPACING_S;
    const int at = 6 * (WALK_WINDOW - 1);
    const int before = at - 6;
    const real turn = step * self->now[2];
    const real middle = (real)self->path[before + 2] + (real)0.5 * turn;
    const real along = step * self->now[0];
    const real across = step * self->now[1];
    const real x = COS(middle) * along - SIN(middle) * across;
    const real y = SIN(middle) * along + COS(middle) * across;
    self->path[at] = self->path[before] + (double)x;
    self->path[at + 1] = self->path[before + 1] + (double)y;
    self->path[at + 2] = self->path[before + 2] + (double)turn;
    self->path[at + 3] = self->path[before + 3] + (double)along;
    self->path[at + 4] = self->path[before + 4] + (double)across;
    self->path[at + 5] = (double)self->now[2];
}

/* A number of a node at the velocity of the last sample. */
static MAYBE_UNUSED real walk_walker_at_node(walk_walker *self, const real *nodes, int node, int i)
{
    real value = nodes[WALK_NODE * node + i];
    for (int k = 0; k < 3; ++k) {
        value += self->now[k] * nodes[WALK_NODE * node + 40 * (k + 1) + i];
    }
    return value;
}

/* One more sample at the end, in place of the first. Its torques are in torque; pass the input that they produce
 * to Walker::keep_input. */
static MAYBE_UNUSED void walk_walker_advance(walk_walker *restrict self, const walk_gait *gait, const real *nodes,
        double range_s)
{
    walk_walker_shift(self);
    walk_walker_pace(self, gait, range_s);
    walk_walker_move_along(self);
    const real place = self->share * (real)gait->count;
    const int whole = (int)place;
    const int node = whole < gait->count ? whole : 0;
    const int next = node + 1 < gait->count ? node + 1 : 0;
    const real between = place - (real)whole;
    real row[40] = {0};
    for (int i = 0; i < 40; ++i) {
        const real from = walk_walker_at_node(self, nodes, node, i);
        row[i] = from + between * (walk_walker_at_node(self, nodes, next, i) - from);
    }
    const int last = WALK_WINDOW - 1;
    for (int i = 0; i < 18; ++i) {
        const int at = 18 * last + i;
        self->x[at] = gait->stand[i] + self->amplitude * (row[i] - gait->stand[i]);
    }
    for (int i = 0; i < 2; ++i) {
        self->x[18 * last + 12 + i] += (real)self->path[6 * last + 3 + i];
    }
    const real step = (real)WALK_SPACING_S;
    for (int i = 18 * last; i < 18 * (last + 1); ++i) {
        self->dx[i - 18] = (self->x[i] - self->x[i - 36]) / (2 * step);
        self->dx[i] = (self->x[i] - self->x[i - 18]) / step;
    }
    for (int joint = 0; joint < 12; ++joint) {
        self->torque[joint] = row[18 + joint];
    }
    for (int foot = 0; foot < 4; ++foot) {
        self->feet[4 * last + foot] = self->amplitude <= 0 || row[36 + foot] > (real)0.5;
    }
}

/* Stands where the path begins: the walk starts at time 0, the samples before it are those of the stand. */
static MAYBE_UNUSED void walk_walker_clear(walk_walker *restrict self, const walk_gait *gait)
{
    for (int i = 0; i < 3; ++i) {
        self->asked[i] = 0;
        self->now[i] = 0;
    }
    self->stops = false;
    self->in_place = 0;
    self->amplitude = 0;
    self->rest_s = 0.0;
    self->share = 0;
    for (int sample = 0; sample < WALK_WINDOW; ++sample) {
        self->time_s[sample] = ((double)sample - (double)(WALK_WINDOW - WALK_AHEAD)) * WALK_SPACING_S;
        for (int i = 0; i < 18; ++i) {
            self->x[18 * sample + i] = gait->stand[i];
            self->dx[18 * sample + i] = 0;
            self->u[18 * sample + i] = gait->stand[18 + i];
        }
        for (int foot = 0; foot < 4; ++foot) {
            self->feet[4 * sample + foot] = true;
        }
        for (int i = 0; i < 6; ++i) {
            self->path[6 * sample + i] = 0.0;
        }
    }
}

/* Sets the commanded velocity, clamped to the allowed range. */
static MAYBE_UNUSED void walk_walker_command(walk_walker *restrict self, const walk_gait *gait, const real *velocity)
{
    self->stops = false;
    for (int i = 0; i < 3; ++i) {
        const real enough = velocity[i] < gait->least[i] ? gait->least[i] : velocity[i];
        self->asked[i] = walk_smaller(enough, gait->most[i]);
    }
}

/* Stores the generalised input (18) of the last sample's stride. */
static MAYBE_UNUSED void walk_walker_keep_input(walk_walker *restrict self, const walk_gait *gait, const real *u)
{
    for (int i = 0; i < 18; ++i) {
        const real stand = gait->stand[18 + i];
        self->u[18 * (WALK_WINDOW - 1) + i] = stand + self->amplitude * (u[i] - stand);
    }
}

/* Whether the samples end before a horizon of a time does. Not so for times beyond them: the clock has leapt. */
static MAYBE_UNUSED bool walk_walker_lacks(walk_walker *self, double time_s, double horizon_s)
{
    const double last_s = self->time_s[WALK_WINDOW - 1];
    return time_s <= last_s && last_s < time_s + (horizon_s + WALK_AHEAD_S);
}

/* Moves a state and its velocity from where the walk began to the axes of the path at a time. */
static MAYBE_UNUSED void walk_walker_move_to_path(walk_walker *self, double time_s, real *restrict x,
        real *restrict dx)
{
    const double passed = (time_s - self->time_s[0]) / WALK_SPACING_S;
    int sample = 0;
    real share = 0;
    if (passed > 0.0) {
        const bool is_within = passed < (double)(WALK_WINDOW - 1);
        sample = is_within ? (int)passed : WALK_WINDOW - 2;
        const real within = (real)(passed - (double)sample);
        share = walk_smaller(within, 1);
    }
    real at[6] = {0};
    for (int i = 0; i < 6; ++i) {
        const double from = self->path[6 * sample + i];
        at[i] = (real)(from + (double)share * (self->path[6 * (sample + 1) + i] - from));
    }
    const real cosine = COS(at[2]);
    const real sine = SIN(at[2]);
    const real along = x[12] - at[0];
    const real across = x[13] - at[1];
    x[12] = at[3] + (cosine * along + sine * across);
    x[13] = at[4] + (cosine * across - sine * along);
    const real turned = x[17] - at[2];
    const double turns = (double)(turned / WALK_TURN);
    x[17] = turned - WALK_TURN * (real)FLOOR(turns + 0.5);
    const real forward = dx[12];
    dx[12] = cosine * forward + sine * dx[13];
    dx[13] = cosine * dx[13] - sine * forward;
    dx[17] -= at[5];
}

/* Whether a walk stands at a time: it was stopped, or it has no samples left because the clock leapt without a
 * supervisor. */
static MAYBE_UNUSED bool walk_walker_rests(walk_walker *self, double time_s)
{
    const bool stands = self->stops && self->amplitude <= 0 && time_s >= self->rest_s;
    return stands || time_s > self->time_s[WALK_WINDOW - 1];
}

/* At once the training's mean gait. */
static MAYBE_UNUSED void walk_walker_set_to_mean(walk_walker *restrict self, const walk_gait *gait)
{
    for (int i = 0; i < 3; ++i) {
        self->asked[i] = gait->mean[i];
        self->now[i] = gait->mean[i];
    }
    self->amplitude = 1;
}

/* Slows down, then stands. */
static MAYBE_UNUSED void walk_walker_stop(walk_walker *self)
{
    self->stops = true;
    for (int i = 0; i < 3; ++i) {
        self->asked[i] = 0;
    }
}

