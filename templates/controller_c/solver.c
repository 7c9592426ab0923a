/* @generated from src/control/solver by `cargo run -p romc-translate`: the structured solver.
 * Names that are defined elsewhere: real, the type of numbers; NX and NU, how many states and inputs there are. */

/* A guess is of quite another program if the optimum without rows moved further than this, in units of the input's
 * rows. */
#define SOLVER_FAR_CHANGE 3.0

/* Least share of the way to the boundary that a step leaves. */
#define SOLVER_LEAST_MARGIN 1e-3

/* Share of the residuals at the last centring, those of the gradient among them, that may be left. */
#define SOLVER_LEFT 1e-6

/* The share between the two, in units of the mean complementarity: near the optimum steps may go further. */
#define SOLVER_MARGIN_FACTOR 10.0

/* Most of it. */
#define SOLVER_MOST_MARGIN 5e-3

/* Iterations after which slacks and multipliers are centred again: now and then the method goes round in a circle. */
#define SOLVER_PATIENCE 16

/* Numbers per row: bound, slack, multiplier, weight, target, residual, the change of slack and multiplier, and the
 * slack's inverse. */
#define SOLVER_ROW_NUMBERS 9

/* A first step from a guess that is shorter than this shows that the guess is not near a solution. */
#define SOLVER_SHORT_STEP 0.4

/* Most inputs, and the width of rows of NU numbers that are filled up with zeros: vectors of four then have no odd
 * ends. */
#define SOLVER_WIDE 12

/* Cost of the input before a stage, from the stage on, but for a constant. */
typedef struct {
    /* M, by the state. */
    real by_state[NU][NX];
    /* N, of which the lower triangle is written. */
    real square[NU][NU];
    real linear[NU];
} solver_before;

/* Where slacks and multipliers are centred. */
typedef struct {
    double slack;
    double product;
} solver_centring;

/* The cost, the same at all stages but for the last one's states: 1/2 v^T R v + 1/2 x^T Q x + price t. */
typedef struct {
    /* Diagonal of Q before the last stage. */
    real state[NX];
    /* Diagonal of Q at the last stage. */
    real terminal[NX];
    /* Diagonal of R. */
    real input[NU];
    /* Price of a slack. */
    real slack;
} solver_cost;

/* Rows that link inputs, and memory for their gains. */
typedef struct {
    /* L: Shape::link rows for each place of the ring of stages. */
    real (*rows)[NU];
    /* Memory of the solver, one for each place. */
    real (*gains)[NU][NU];
    /* How much a multiplier's change moves its row in one step. */
    real softness;
} solver_links;

/* Blocks of four columns: columns 0 to 3 of every row, columns 4 to 7 of the rows from the fourth on, columns 8 to 11
 * of those from the eighth on. Entries right of the diagonal are not read. */
typedef struct {
    real blocks[SOLVER_WIDE / 4][NU][4];
} solver_lower;

/* How a solve ended. */
typedef enum { SOLVER_SOLVED, SOLVER_INACCURATE, SOLVER_ITERATION_CAP, SOLVER_NUMERICAL_FAILURE, SOLVER_INFEASIBLE, SOLVER_UNBOUNDED } solver_outcome;

typedef struct {
    /* Share of the gradient that the steps since the last centring have left. */
    real left;
    /* The same share of the rows' residuals; one where these are kept up to date. */
    real kept;
    /* Largest residual of a row at the last centring, or the present one. */
    real residual;
    /* Sum of the products of slacks and multipliers. */
    real sum;
    /* The largest of them. */
    real largest;
    /* sum of v^T R v + x^T Q x, one before the first step. */
    real value;
} solver_point;

/* Products of eliminate, kept from stage to stage so that they need not be cleared. */
typedef struct {
    real pa[NX][NX];
    real pb[NX][SOLVER_WIDE];
    real b[NX][SOLVER_WIDE];
    /* H_vv before the stage's end is added to it; the lower triangle is read. */
    real hvv[NU][SOLVER_WIDE];
    /* The same of H_vx. */
    real hvx[NU][NX];
    real z[NU][NX];
} solver_products;

/* How many rows every stage has, in the order in which their bounds stand. */
typedef struct {
    /* Rows on the input. */
    int input;
    /* Rows on the first NU states at the stage's end, which share one slack. */
    int soft;
    /* Rows that link the input to that of the stage before; their coefficients are in Links. */
    int link;
    /* Number of leading pairs of opposite rows on the input, the two sides of a limit: row, -row. The products and
     * squares of each pair are computed once. */
    int pairs;
} solver_shape;

/* Coefficients of the rows; stages may share them. */
typedef struct {
    /* G of G v <= bound. */
    real (*input)[NU];
    /* E of E x - t <= bound. */
    real (*soft)[NU];
} solver_row_matrices;

/* A program with the memory to solve it, all lent by the caller; LINKED if it has Links. */
typedef struct {
    /* Stages of the horizon. */
    solver_stage *stages;
    int stages_len;
    /* Shape::memory numbers for each stage; bounds first, see Program::bounds_mut. */
    real *rows;
    /* Where the first stage of the horizon stands; the others follow, the slice being a ring. */
    int first;
    /* Numbers of rows. */
    solver_shape shape;
    /* Coefficients of the rows. */
    solver_row_matrices matrices;
    /* Rows that link the inputs of consecutive stages. */
    solver_links links;
    /* The cost. */
    solver_cost cost;
} solver_program;

/* How far a change of all unknowns may go, and the products of the changes of slacks and multipliers. */
typedef struct {
    /* How often the longest step that keeps slacks and multipliers positive goes into a whole one. */
    real times;
    /* Sum of the products, of a change that does not centre. */
    real second_sum;
    /* The largest of them. */
    real second_largest;
} solver_reach;

/* Residuals of the optimality conditions, each relative to the size of the terms it is made of (never less than one). */
typedef struct {
    /* Largest violation of a row or cone, or error of the dynamics. */
    real primal;
    /* Largest derivative of the Lagrangian by an unknown, or violation of the dual cone by a multiplier. */
    real dual;
    /* Gap between primal and dual cost. */
    real gap;
} solver_residuals;

/* The end of a solve. */
typedef struct {
    /* How it ended. */
    solver_outcome outcome;
    /* Interior-point iterations: zero if no row was active. */
    int iterations;
    /* Residuals of the point that was returned. */
    solver_residuals residuals;
} solver_report;

/* The numbers of one stage's rows, as many of each kind. */
typedef struct {
    int count;
    real *bound;
    real *slack;
    real *multiplier;
    real *weight;
    /* Products of the rows with a point, and later numbers that are made of them. */
    real *target;
    real *residual;
    real *dslack;
    real *dmultiplier;
    real *inverse;
} solver_rows;

/* Settings of a solve. */
typedef struct {
    /* Cap on interior-point iterations. */
    int max_iterations;
    /* Violation of rows and largest product of slack and multiplier at which the iterations end. */
    real tolerance;
    /* Sum of these products, in units of sum of v^T R v + x^T Q x or of one where that is less, at which the iterations end
     * as well; zero for the largest product to decide. */
    real gap;
    /* Largest residual of the optimality conditions with which a point counts as solved. */
    real accepted_residual;
} solver_settings;

/* Where a guess turned out to be poor, or the iterations go round in a circle. */
static const solver_centring SOLVER_AGAIN = {.slack = 1e-1, .product = 2e-1};

/* At a start from the gains. */
static const solver_centring SOLVER_COLD = {.slack = 3e-1, .product = 3.0};

/* At a start from a guess at the solution of quite another program. */
static const solver_centring SOLVER_FAR = {.slack = 3e-1, .product = 1.0};

/* At a start from a guess. */
static const solver_centring SOLVER_WARM = {.slack = 1e-2, .product = 1e-3};

/* Where a stage of the horizon stands in the ring. */
static inline int solver_program_at(solver_program *self, int stage)
{
    const int place = self->first + stage;
    return place < self->stages_len ? place : place - self->stages_len;
}

static inline int solver_shape_first_link(solver_shape *self)
{
    const int slack = self->soft > 0 ? 1 : 0;
    return self->input + self->soft + slack;
}

/* Rows of a stage; a slack's own t >= 0 follows its soft rows. */
static inline int solver_shape_rows(solver_shape *self)
{
    return solver_shape_first_link(self) + self->link;
}

/* Numbers that a stage's rows need of Program::rows. */
static inline int solver_shape_memory(solver_shape *self)
{
    return SOLVER_ROW_NUMBERS * solver_shape_rows(self);
}

/* Right-hand sides of a stage's rows: input, soft, link; the one of t >= 0 in between is zero. */
static inline real *solver_program_bounds_mut(solver_program *self, int stage)
{
    const int first = solver_program_at(self, stage) * solver_shape_memory(&self->shape);
    return self->rows + first;
}

static inline solver_products solver_products_zeros(void)
{
    return (solver_products){.pa = {{0}}, .pb = {{0}}, .b = {{0}}, .hvv = {{0}}, .hvx = {{0}}, .z = {{0}}};
}

static inline const real *solver_cost_state_at(solver_cost *self, int stage, int horizon)
{
    return stage + 1 == horizon ? self->terminal : self->state;
}

/* out += M x, each row summed in the order of its entries; four rows at a time, as their sums do not wait for each
 * other. */
static inline void solver_add_product_nx_nx(real matrix[NX][NX], const real *x, real out[restrict NX])
{
    for (int i = 0; i < NX - NX % 4; i += 4) {
        real sums[4] = {0};
        for (int r = 0; r < 4; ++r) {
            sums[r] = out[i + r];
        }
        for (int j = 0; j < NX; ++j) {
            for (int r = 0; r < 4; ++r) {
                sums[r] += matrix[i + r][j] * x[j];
            }
        }
        for (int r = 0; r < 4; ++r) {
            out[i + r] = sums[r];
        }
    }
    for (int i = NX - NX % 4; i < NX; ++i) {
        real sum = out[i];
        for (int j = 0; j < NX; ++j) {
            sum += matrix[i][j] * x[j];
        }
        out[i] = sum;
    }
}

static inline void solver_products_clear_hessian(solver_products *self)
{
    for (int i = 0; i < NU; ++i) {
        memset(self->hvv[i], 0, sizeof(real[SOLVER_WIDE]));
        memset(self->hvx[i], 0, sizeof(real[NX]));
    }
}

/* out += factor row. */
static inline void solver_add_multiple_nx(real factor, const real *row, real out[restrict NX])
{
    for (int j = 0; j < NX; ++j) {
        out[j] += factor * row[j];
    }
}

/* out += factor row of rows of NU numbers and zeros. */
static inline void solver_add_wide(real factor, const real *row, real out[restrict SOLVER_WIDE])
{
    for (int j = 0; j < (NU + 3) / 4 * 4; ++j) {
        out[j] += factor * row[j];
    }
}

/* out_x += left^T x and out_v += left^T v of the first M columns of left. */
static inline void solver_add_products_nx_nx(real left[NX][NX], real x[NX][NX], real v[NX][SOLVER_WIDE],
        real out_x[restrict NX][NX], real out_v[restrict NX][SOLVER_WIDE])
{
    /* Two rows at a time: each load of x and v serves both. */
    for (int i = 0; i < NX - NX % 2; i += 2) {
        real first_x[NX];
        memcpy(first_x, out_x[i], sizeof first_x);
        real second_x[NX];
        memcpy(second_x, out_x[i + 1], sizeof second_x);
        real first_v[SOLVER_WIDE];
        memcpy(first_v, out_v[i], sizeof first_v);
        real second_v[SOLVER_WIDE];
        memcpy(second_v, out_v[i + 1], sizeof second_v);
        for (int k = 0; k < NX; ++k) {
            solver_add_multiple_nx(left[k][i], x[k], first_x);
            solver_add_multiple_nx(left[k][i + 1], x[k], second_x);
            solver_add_wide(left[k][i], v[k], first_v);
            solver_add_wide(left[k][i + 1], v[k], second_v);
        }
        memcpy(out_x[i], first_x, sizeof(real[NX]));
        memcpy(out_x[i + 1], second_x, sizeof(real[NX]));
        memcpy(out_v[i], first_v, sizeof(real[SOLVER_WIDE]));
        memcpy(out_v[i + 1], second_v, sizeof(real[SOLVER_WIDE]));
    }
    for (int i = NX - NX % 2; i < NX; ++i) {
        for (int k = 0; k < NX; ++k) {
            solver_add_multiple_nx(left[k][i], x[k], out_x[i]);
            solver_add_wide(left[k][i], v[k], out_v[i]);
        }
    }
}

/* out_x += left^T x and out_v += left^T v of the first M columns of left. */
static inline void solver_add_products_wide_nu(real left[NX][SOLVER_WIDE], real x[NX][NX], real v[NX][SOLVER_WIDE],
        real out_x[restrict NU][NX], real out_v[restrict NU][SOLVER_WIDE])
{
    /* Two rows at a time: each load of x and v serves both. */
    for (int i = 0; i < NU - NU % 2; i += 2) {
        real first_x[NX];
        memcpy(first_x, out_x[i], sizeof first_x);
        real second_x[NX];
        memcpy(second_x, out_x[i + 1], sizeof second_x);
        real first_v[SOLVER_WIDE];
        memcpy(first_v, out_v[i], sizeof first_v);
        real second_v[SOLVER_WIDE];
        memcpy(second_v, out_v[i + 1], sizeof second_v);
        for (int k = 0; k < NX; ++k) {
            solver_add_multiple_nx(left[k][i], x[k], first_x);
            solver_add_multiple_nx(left[k][i + 1], x[k], second_x);
            solver_add_wide(left[k][i], v[k], first_v);
            solver_add_wide(left[k][i + 1], v[k], second_v);
        }
        memcpy(out_x[i], first_x, sizeof(real[NX]));
        memcpy(out_x[i + 1], second_x, sizeof(real[NX]));
        memcpy(out_v[i], first_v, sizeof(real[SOLVER_WIDE]));
        memcpy(out_v[i + 1], second_v, sizeof(real[SOLVER_WIDE]));
    }
    for (int i = NU - NU % 2; i < NU; ++i) {
        for (int k = 0; k < NX; ++k) {
            solver_add_multiple_nx(left[k][i], x[k], out_x[i]);
            solver_add_wide(left[k][i], v[k], out_v[i]);
        }
    }
}

/* Whether it is neither infinite nor not a number. */
static inline bool solver_is_finite_number(real self)
{
    /* Infinity less itself is not a number, and no such number equals itself. */
    const real difference = self - self;
    return (difference <= 0 && difference >= 0);
}

/* L D L^T of a symmetric matrix, of which the lower triangle is read; false if it is not positive definite. */
static inline bool solver_factorise(real matrix[NU][SOLVER_WIDE], real factor[restrict NU][NU])
{
    for (int j = 0; j < NU; ++j) {
        real pivot = matrix[j][j];
        real scaled[NU] = {0};
        for (int k = 0; k < j; ++k) {
            /* The inverse of D is stored: L_jk D_k is the entry before its division. */
            scaled[k] = factor[k][j];
            pivot = pivot - factor[j][k] * scaled[k];
        }
        if (!(pivot > 0 && solver_is_finite_number(pivot))) {
            return false;
        }
        const real inverse = 1 / pivot;
        factor[j][j] = inverse;
        for (int i = j + 1; i < NU; ++i) {
            real entry = matrix[i][j];
            for (int k = 0; k < j; ++k) {
                entry = entry - factor[i][k] * scaled[k];
            }
            factor[j][i] = entry;
            factor[i][j] = entry * inverse;
        }
    }
    return true;
}

/* M <- L^-1 M. */
static inline void solver_solve_lower_rows_nx(real factor[NU][NU], real matrix[restrict NU][NX])
{
    for (int i = 1; i < NU; ++i) {
        for (int k = 0; k < i; ++k) {
            const real entry = factor[i][k];
            for (int j = 0; j < NX; ++j) {
                matrix[i][j] = matrix[i][j] - entry * matrix[k][j];
            }
        }
    }
}

/* out = D^-1 M. */
static inline void solver_scale_rows_nx(real factor[NU][NU], real matrix[NU][NX], real out[restrict NU][NX])
{
    for (int i = 0; i < NU; ++i) {
        for (int j = 0; j < NX; ++j) {
            out[i][j] = factor[i][i] * matrix[i][j];
        }
    }
}

/* out += factor row. */
static inline void solver_add_multiple_8(real factor, const real *row, real out[restrict 8])
{
    for (int j = 0; j < 8; ++j) {
        out[j] += factor * row[j];
    }
}

/* out -= factor row. */
static inline void solver_subtract_multiple_8(real factor, const real *row, real out[restrict 8])
{
    for (int j = 0; j < 8; ++j) {
        out[j] = out[j] - factor * row[j];
    }
}

/* W columns of four rows of P, from this row and column on: a block that stays in registers. */
static inline void solver_products_write_block_8(solver_products *self, int i, int j, real a[NX][NX],
        real p[restrict NX][NX])
{
    real block[4][8] = {{0}};
    for (int k = 0; k < NX; ++k) {
        const real *row = self->pa[k] + j;
        for (int r = 0; r < 4; ++r) {
            solver_add_multiple_8(a[k][i + r], row, block[r]);
        }
    }
    for (int k = 0; k < NU; ++k) {
        const real *row = self->z[k] + j;
        for (int r = 0; r < 4; ++r) {
            solver_subtract_multiple_8(self->hvx[k][i + r], row, block[r]);
        }
    }
    for (int r = 0; r < 4; ++r) {
        real *row = p[i + r] + j;
        memcpy(row, block[r], sizeof(real[8]));
    }
}

/* out += factor row. */
static inline void solver_add_multiple_4(real factor, const real *row, real out[restrict 4])
{
    for (int j = 0; j < 4; ++j) {
        out[j] += factor * row[j];
    }
}

/* out -= factor row. */
static inline void solver_subtract_multiple_4(real factor, const real *row, real out[restrict 4])
{
    for (int j = 0; j < 4; ++j) {
        out[j] = out[j] - factor * row[j];
    }
}

/* W columns of four rows of P, from this row and column on: a block that stays in registers. */
static inline void solver_products_write_block_4(solver_products *self, int i, int j, real a[NX][NX],
        real p[restrict NX][NX])
{
    real block[4][4] = {{0}};
    for (int k = 0; k < NX; ++k) {
        const real *row = self->pa[k] + j;
        for (int r = 0; r < 4; ++r) {
            solver_add_multiple_4(a[k][i + r], row, block[r]);
        }
    }
    for (int k = 0; k < NU; ++k) {
        const real *row = self->z[k] + j;
        for (int r = 0; r < 4; ++r) {
            solver_subtract_multiple_4(self->hvx[k][i + r], row, block[r]);
        }
    }
    for (int r = 0; r < 4; ++r) {
        real *row = p[i + r] + j;
        memcpy(row, block[r], sizeof(real[4]));
    }
}

/* out -= factor row. */
static inline void solver_subtract_multiple_nx(real factor, const real *row, real out[restrict NX])
{
    for (int j = 0; j < NX; ++j) {
        out[j] = out[j] - factor * row[j];
    }
}

/* P = A^T P A - Y^T Z by its lower triangle, with Y in the place of H_vx. */
static inline void solver_products_write_beginning(solver_products *self, real a[NX][NX], real p[restrict NX][NX])
{
    if (NX >= 4) {
        for (int i = 0; i < NX - NX % 4; i += 4) {
            for (int j = 0; j < i + 4; j += 8) {
                if (j + 8 <= i + 4) {
                    solver_products_write_block_8(self, i, j, a, p);
                } else {
                    solver_products_write_block_4(self, i, j, a, p);
                }
            }
        }
    }
    for (int i = NX - NX % 4; i < NX; ++i) {
        real row[NX] = {0};
        for (int k = 0; k < NX; ++k) {
            solver_add_multiple_nx(a[k][i], self->pa[k], row);
        }
        for (int k = 0; k < NU; ++k) {
            solver_subtract_multiple_nx(self->hvx[k][i], self->z[k], row);
        }
        memcpy(p[i], row, sizeof(real[NX]));
    }
    for (int i = 0; i < NX; ++i) {
        for (int j = 0; j < i; ++j) {
            p[j][i] = p[i][j];
        }
    }
}

/* M <- L^-T M. */
static inline void solver_solve_upper_rows_nx(real factor[NU][NU], real matrix[restrict NU][NX])
{
    for (int i = NU - 1; i >= 0; --i) {
        for (int k = i + 1; k < NU; ++k) {
            const real entry = factor[k][i];
            for (int j = 0; j < NX; ++j) {
                matrix[i][j] = matrix[i][j] - entry * matrix[k][j];
            }
        }
    }
}

/* P of one stage's end to P of its beginning, without the costs there; gain and factor of the stage are
 * overwritten. False if the whole Hessian of the input is not positive definite. */
static inline bool solver_eliminate(solver_stage *restrict stage, real p[restrict NX][NX],
        solver_products *restrict products)
{
    for (int k = 0; k < NX; ++k) {
        for (int j = 0; j < NU; ++j) {
            products->b[k][j] = stage->b[k][j];
        }
    }
    /* P A and P B, as P is symmetric; H_vx += B^T P A and H_vv += B^T P B. */
    memset(products->pa, 0, sizeof(real[NX][NX]));
    memset(products->pb, 0, sizeof(real[NX][SOLVER_WIDE]));
    solver_add_products_nx_nx(p, stage->a, products->b, products->pa, products->pb);
    solver_add_products_wide_nu(products->b, products->pa, products->pb, products->hvx, products->hvv);
    if (!solver_factorise(products->hvv, stage->factor)) {
        return false;
    }
    /* Y = L^-1 H_vx, Z = D^-1 Y; P = H_xx - Y^T Z; K = L^-T Z. */
    solver_solve_lower_rows_nx(stage->factor, products->hvx);
    solver_scale_rows_nx(stage->factor, products->hvx, products->z);
    solver_products_write_beginning(products, stage->a, p);
    solver_solve_upper_rows_nx(stage->factor, products->z);
    memcpy(stage->gain, products->z, sizeof(real[NU][NX]));
    return true;
}

/* out += factor row. */
static inline void solver_add_multiple_nu(real factor, const real *row, real out[restrict NU])
{
    for (int j = 0; j < NU; ++j) {
        out[j] += factor * row[j];
    }
}

/* out += M^T y. */
static inline void solver_add_transposed_nx_nu(real matrix[NX][NU], const real *y, real out[restrict NU])
{
    for (int k = 0; k < NX; ++k) {
        solver_add_multiple_nu(y[k], matrix[k], out);
    }
}

/* H_vv^-1 h by a factor of factorise, in the place of h. */
static inline void solver_solve_factored(real factor[NU][NU], real h[restrict NU])
{
    for (int i = 1; i < NU; ++i) {
        for (int k = 0; k < i; ++k) {
            h[i] = h[i] - factor[i][k] * h[k];
        }
    }
    for (int i = 0; i < NU; ++i) {
        h[i] = h[i] * factor[i][i];
    }
    for (int i = NU - 1; i >= 0; --i) {
        for (int k = i + 1; k < NU; ++k) {
            h[i] = h[i] - factor[k][i] * h[k];
        }
    }
}

/* out += M^T y. */
static inline void solver_add_transposed_nx_nx(real matrix[NX][NX], const real *y, real out[restrict NX])
{
    for (int k = 0; k < NX; ++k) {
        solver_add_multiple_nx(y[k], matrix[k], out);
    }
}

/* Gradient pass from the stage's end to its beginning. On input p is the gradient at the end, including the
 * cost's own, and h the gradient by the input. On output p is the gradient at the beginning and h the whole
 * gradient by the input. Overwrites the constant part of the input. */
static inline void solver_stage_pull(solver_stage *restrict self, real p[restrict NX], real h[restrict NU])
{
    solver_add_transposed_nx_nu(self->b, p, h);
    real feed[NU];
    memcpy(feed, h, sizeof feed);
    solver_solve_factored(self->factor, feed);
    memcpy(self->feed, feed, sizeof(real[NU]));
    real next[NX] = {0};
    solver_add_transposed_nx_nx(self->a, p, next);
    for (int k = 0; k < NU; ++k) {
        for (int j = 0; j < NX; ++j) {
            next[j] = next[j] - self->gain[k][j] * h[k];
        }
    }
    memcpy(p, next, sizeof(real[NX]));
}

/* Eliminates all stages without their rows: gains and constant parts of the linear-quadratic optimum from any
 * initial state. False if a Hessian is not positive definite. */
static inline bool solver_program_prepare(solver_program *self)
{
    const int horizon = self->stages_len;
    solver_products products = solver_products_zeros();
    real p[NX][NX] = {{0}};
    real linear[NX] = {0};
    for (int k = horizon - 1; k >= 0; --k) {
        const real *weight = solver_cost_state_at(&self->cost, k, horizon);
        const int at = solver_program_at(self, k);
        solver_stage *stage = &self->stages[at];
        for (int i = 0; i < NX; ++i) {
            p[i][i] += weight[i];
        }
        solver_add_product_nx_nx(p, stage->c, linear);
        solver_products_clear_hessian(&products);
        for (int i = 0; i < NU; ++i) {
            products.hvv[i][i] = self->cost.input[i];
        }
        if (!solver_eliminate(stage, p, &products)) {
            return false;
        }
        real by_v[NU] = {0};
        solver_stage_pull(stage, linear, by_v);
    }
    return true;
}

/* Moves the horizon on by one stage: the second becomes the first, and the first the last, whose data have to be
 * written then. Inputs, slacks and multipliers stay as a guess at the next solution. */
static inline void solver_program_shift(solver_program *self)
{
    const int rows = solver_shape_rows(&self->shape);
    const int memory = solver_shape_memory(&self->shape);
    const int last = solver_program_at(self, self->stages_len - 1);
    const int fresh = self->first;
    if (last != fresh) {
        memcpy(self->stages[fresh].v, self->stages[last].v, sizeof(real[NU]));
        self->stages[fresh].t = self->stages[last].t;
        memcpy(self->stages[fresh].plain, self->stages[last].plain, sizeof(real[NU]));
        for (int i = 2 * rows; i < 3 * rows; ++i) {
            self->rows[fresh * memory + i] = self->rows[last * memory + i];
        }
        self->first = solver_program_at(self, 1);
    }
}

/* out += M x, each row summed in the order of its entries; four rows at a time, as their sums do not wait for each
 * other. */
static inline void solver_add_product_nu_nx(real matrix[NU][NX], const real *x, real out[restrict NU])
{
    for (int i = 0; i < NU - NU % 4; i += 4) {
        real sums[4] = {0};
        for (int r = 0; r < 4; ++r) {
            sums[r] = out[i + r];
        }
        for (int j = 0; j < NX; ++j) {
            for (int r = 0; r < 4; ++r) {
                sums[r] += matrix[i + r][j] * x[j];
            }
        }
        for (int r = 0; r < 4; ++r) {
            out[i + r] = sums[r];
        }
    }
    for (int i = NU - NU % 4; i < NU; ++i) {
        real sum = out[i];
        for (int j = 0; j < NX; ++j) {
            sum += matrix[i][j] * x[j];
        }
        out[i] = sum;
    }
}

/* Input from the state at the stage's beginning: -feed - K x. */
static inline void solver_stage_answer(solver_stage *self, const real *x, real v[restrict NU])
{
    real sum[NU];
    memcpy(sum, self->feed, sizeof sum);
    solver_add_product_nu_nx(self->gain, x, sum);
    for (int i = 0; i < NU; ++i) {
        v[i] = -sum[i];
    }
}

/* out += M x, each row summed in the order of its entries; four rows at a time, as their sums do not wait for each
 * other. */
static inline void solver_add_product_nx_nu(real matrix[NX][NU], const real *x, real out[restrict NX])
{
    for (int i = 0; i < NX - NX % 4; i += 4) {
        real sums[4] = {0};
        for (int r = 0; r < 4; ++r) {
            sums[r] = out[i + r];
        }
        for (int j = 0; j < NU; ++j) {
            for (int r = 0; r < 4; ++r) {
                sums[r] += matrix[i + r][j] * x[j];
            }
        }
        for (int r = 0; r < 4; ++r) {
            out[i + r] = sums[r];
        }
    }
    for (int i = NX - NX % 4; i < NX; ++i) {
        real sum = out[i];
        for (int j = 0; j < NU; ++j) {
            sum += matrix[i][j] * x[j];
        }
        out[i] = sum;
    }
}

/* State at the stage's end: A x + B v + c. */
static inline void solver_stage_end(solver_stage *self, const real *x, const real *v, real end[restrict NX])
{
    real sum[NX];
    memcpy(sum, self->c, sizeof sum);
    solver_add_product_nx_nx(self->a, x, sum);
    solver_add_product_nx_nu(self->b, v, sum);
    memcpy(end, sum, sizeof(real[NX]));
}

static inline solver_rows solver_rows_of(real *memory, int count)
{
    real *bound = memory;
    real *rest = memory + count;
    real *slack = rest;
    rest = rest + count;
    real *multiplier = rest;
    rest = rest + count;
    real *weight = rest;
    rest = rest + count;
    real *target = rest;
    rest = rest + count;
    real *residual = rest;
    rest = rest + count;
    real *dslack = rest;
    rest = rest + count;
    real *dmultiplier = rest;
    rest = rest + count;
    real *inverse = rest;
    return (solver_rows){.count = count, .bound = bound, .slack = slack, .multiplier = multiplier, .weight = weight,
            .target = target, .residual = residual, .dslack = dslack, .dmultiplier = dmultiplier, .inverse = inverse};
}

static inline real solver_dot(const real *row, const real *x)
{
    real sum = row[0] * x[0];
    for (int j = 1; j < NU; ++j) {
        sum += row[j] * x[j];
    }
    return sum;
}

/* out = rows x of count rows, of which so many pairs of opposite ones come first. */
static inline void solver_times(real (*rows)[NU], int pairs, int count, const real *x, real *restrict out)
{
    for (int pair = 0; pair < pairs; ++pair) {
        const real product = solver_dot(rows[2 * pair], x);
        out[2 * pair] = product;
        out[2 * pair + 1] = -product;
    }
    for (int i = 2 * pairs; i < count; ++i) {
        out[i] = solver_dot(rows[i], x);
    }
}

static inline int solver_shape_slack_row(solver_shape *self)
{
    return self->input + self->soft;
}

/* The rows of a stage times a point, into their target; before is the input of the stage before. */
static inline solver_rows solver_program_rows_times(solver_program *restrict self, int k, const real *before,
        const real *v, const real *x, real t)
{
    solver_shape shape = self->shape;
    const bool linked = LINKED;
    const int memory = solver_shape_memory(&shape);
    const int place = solver_program_at(self, k);
    const int before_place = k > 0 ? solver_program_at(self, k - 1) : 0;
    solver_rows rows = solver_rows_of(self->rows + place * memory, solver_shape_rows(&shape));
    solver_stage *stage = &self->stages[place];
    real (*input)[NU] = self->matrices.input + stage->input_rows;
    solver_times(input, shape.pairs, shape.input, v, rows.target);
    if (NU <= NX && shape.soft > 0) {
        const real *z = x + 0;
        real (*soft)[NU] = self->matrices.soft + stage->soft_rows;
        real *products = rows.target + shape.input;
        for (int i = 0; i < shape.soft; ++i) {
            products[i] = solver_dot(soft[i], z) - t;
        }
        rows.target[solver_shape_slack_row(&shape)] = -t;
    }
    if (linked) {
        real *products = rows.target + solver_shape_first_link(&shape);
        const int first = place * shape.link;
        solver_times(self->links.rows + first, 0, shape.link, v, products);
        if (k > 0) {
            const int first_earlier = before_place * shape.link;
            real (*earlier)[NU] = self->links.rows + first_earlier;
            for (int i = 0; i < shape.link; ++i) {
                products[i] = products[i] - solver_dot(earlier[i], before);
            }
        }
    }
    return rows;
}

/* States and inputs that the gains give, kept if no row is violated; returns the largest violation. */
static inline real solver_program_follow_gains(solver_program *restrict self, const real *x0)
{
    real worst = 0;
    real x[NX];
    memcpy(x, x0, sizeof x);
    real before[NU] = {0};
    for (int k = 0; k < self->stages_len; ++k) {
        const int at = solver_program_at(self, k);
        solver_stage *stage = &self->stages[at];
        real v[NU] = {0};
        real end[NX] = {0};
        solver_stage_answer(stage, x, v);
        solver_stage_end(stage, x, v, end);
        memcpy(stage->dv, v, sizeof(real[NU]));
        memcpy(stage->dx, end, sizeof(real[NX]));
        memcpy(x, end, sizeof(real[NX]));
        solver_rows rows = solver_program_rows_times(self, k, before, v, x, 0);
        memcpy(before, v, sizeof(real[NU]));
        for (int i = 0; i < rows.count; ++i) {
            const real violation = rows.target[i] - rows.bound[i];
            /* Written so that a violation that is not a number is kept. */
            if (!(violation <= worst)) {
                worst = violation;
            }
        }
        if (!solver_is_finite_number(worst)) {
            return worst;
        }
    }
    return worst;
}

static inline solver_report solver_failure(int iterations)
{
    const real zero = 0;
    const real infinite = 1 / zero;
    return (solver_report){.outcome = SOLVER_NUMERICAL_FAILURE, .iterations = iterations,
            .residuals = {.primal = infinite, .dual = infinite, .gap = infinite}};
}

static inline solver_rows solver_program_rows_of(solver_program *self, int stage)
{
    const int memory = solver_shape_memory(&self->shape);
    const int first = solver_program_at(self, stage) * memory;
    return solver_rows_of(self->rows + first, solver_shape_rows(&self->shape));
}

/* Multipliers of a stage where no row is active: the whole price at the slack. */
static inline void solver_rows_write_multipliers(solver_rows *self, int soft, int slack_row, real price)
{
    for (int i = 0; i < self->count; ++i) {
        self->multiplier[i] = 0;
    }
    if (soft > 0) {
        self->multiplier[slack_row] = price;
    }
}

/* Uses the point of the gains as the solution: no row is active. */
static inline void solver_program_take_gains(solver_program *self)
{
    solver_shape shape = self->shape;
    const real price = self->cost.slack;
    for (int k = 0; k < self->stages_len; ++k) {
        const int at = solver_program_at(self, k);
        solver_stage *stage = &self->stages[at];
        memcpy(stage->v, stage->dv, sizeof(real[NU]));
        memcpy(stage->plain, stage->dv, sizeof(real[NU]));
        memcpy(stage->x, stage->dx, sizeof(real[NX]));
        stage->t = 0;
        solver_rows rows = solver_program_rows_of(self, k);
        solver_rows_write_multipliers(&rows, shape.soft, solver_shape_slack_row(&shape), price);
    }
}

/* First point of the iterations, to be centred: the guess, or the point of the gains. */
static inline void solver_program_start(solver_program *restrict self, const real *x0, bool is_warm)
{
    solver_shape shape = self->shape;
    const real price = self->cost.slack;
    real x[NX];
    memcpy(x, x0, sizeof x);
    for (int k = 0; k < self->stages_len; ++k) {
        const int at = solver_program_at(self, k);
        solver_stage *stage = &self->stages[at];
        if (!is_warm) {
            memcpy(stage->v, stage->dv, sizeof(real[NU]));
            stage->t = 0;
        }
        real end[NX] = {0};
        solver_stage_end(stage, x, stage->v, end);
        memcpy(stage->x, end, sizeof(real[NX]));
        memcpy(x, end, sizeof(real[NX]));
        if (!is_warm) {
            solver_rows rows = solver_program_rows_of(self, k);
            solver_rows_write_multipliers(&rows, shape.soft, solver_shape_slack_row(&shape), price);
        }
    }
}

/* Its magnitude. */
static inline real solver_magnitude(real self)
{
    return self < 0 ? -self : self;
}

/* The larger of two; not a number if the other is not. */
static inline real solver_or_larger(real self, real other)
{
    return self > other ? self : other;
}

static inline real (*solver_program_link_rows(solver_program *self, int k))[NU]
{
    return self->links.rows + solver_program_at(self, k) * self->shape.link;
}

/* How far the optimum without rows moved since the last program, in units of the input's rows. */
static inline real solver_program_change_of_gains(solver_program *self)
{
    const bool linked = LINKED;
    real largest = 0;
    for (int k = 0; k < self->stages_len; ++k) {
        const int at = solver_program_at(self, k);
        solver_stage *stage = &self->stages[at];
        real change[NU];
        memcpy(change, stage->dv, sizeof change);
        for (int i = 0; i < NU; ++i) {
            change[i] = change[i] - stage->plain[i];
        }
        memcpy(stage->plain, stage->dv, sizeof(real[NU]));
        real (*input)[NU] = self->matrices.input + stage->input_rows;
        for (int i = 0; i < self->shape.input; ++i) {
            largest = solver_or_larger(solver_magnitude(solver_dot(input[i], change)), largest);
        }
        if (linked) {
            real (*links)[NU] = solver_program_link_rows(self, k);
            for (int i = 0; i < self->shape.link; ++i) {
                largest = solver_or_larger(solver_magnitude(solver_dot(links[i], change)), largest);
            }
        }
    }
    return largest;
}

static inline solver_point solver_point_zeros(void)
{
    return (solver_point){.left = 0, .kept = 0, .residual = 0, .sum = 0, .largest = 0, .value = 0};
}

/* The largest of numbers and one more, four at a time. */
static inline real solver_largest_of(const real *values, int count, real so_far)
{
    const int fours = count / 4;
    real lanes[4];
    for (int i = 0; i < 4; ++i) {
        lanes[i] = so_far;
    }
    for (int four = 0; four < fours; ++four) {
        const real *next = values + 4 * four;
        for (int j = 0; j < 4; ++j) {
            lanes[j] = solver_or_larger(next[j], lanes[j]);
        }
    }
    for (int i = 4 * fours; i < count; ++i) {
        lanes[i % 4] = solver_or_larger(values[i], lanes[i % 4]);
    }
    const real first = solver_or_larger(lanes[0], lanes[1]);
    return solver_or_larger(first, solver_or_larger(lanes[2], lanes[3]));
}

/* The sum of numbers in four parts, those of every fourth one. */
static inline real solver_sum_of(const real *values, int count)
{
    const int fours = count / 4;
    real parts[4] = {0};
    for (int four = 0; four < fours; ++four) {
        const real *next = values + 4 * four;
        for (int j = 0; j < 4; ++j) {
            parts[j] += next[j];
        }
    }
    for (int i = 4 * fours; i < count; ++i) {
        parts[i % 4] += values[i];
    }
    return parts[0] + parts[1] + (parts[2] + parts[3]);
}

/* Slacks and multipliers of the present point, none smaller than these. */
static inline solver_point solver_program_centre(solver_program *self, solver_centring smallest)
{
    real residual = 0;
    real sum = 0;
    real largest = 0;
    real before[NU] = {0};
    for (int k = 0; k < self->stages_len; ++k) {
        solver_stage *stage = &self->stages[solver_program_at(self, k)];
        real v[NU];
        memcpy(v, stage->v, sizeof v);
        real x[NX];
        memcpy(x, stage->x, sizeof x);
        const real t = stage->t;
        solver_rows rows = solver_program_rows_times(self, k, before, v, x, t);
        memcpy(before, v, sizeof(real[NU]));
        for (int i = 0; i < rows.count; ++i) {
            const real room = rows.bound[i] - rows.target[i];
            const real slack = solver_or_larger((real)smallest.slack, room);
            const real multiplier = (real)smallest.product / slack;
            rows.slack[i] = slack;
            rows.multiplier[i] = solver_or_larger(multiplier, rows.multiplier[i]);
            rows.residual[i] = slack - room;
        }
        residual = solver_largest_of(rows.residual, rows.count, residual);
        for (int i = 0; i < rows.count; ++i) {
            rows.target[i] = rows.slack[i] * rows.multiplier[i];
        }
        sum += solver_sum_of(rows.target, rows.count);
        largest = solver_largest_of(rows.target, rows.count, largest);
    }
    return (solver_point){.left = 1, .kept = 1, .residual = residual, .sum = sum, .largest = largest, .value = 1};
}

static inline real solver_point_infeasibility(solver_point *self)
{
    return self->kept * self->residual;
}

/* Whether the iterations may end here: gradient and rows hold, and each product, or the gap between primal and
 * dual cost, is small. */
static inline bool solver_point_is_optimal(solver_point *self, solver_settings *settings)
{
    return self->left <= (real)SOLVER_LEFT && solver_point_infeasibility(self) <= settings->tolerance
            && (self->largest <= settings->tolerance
            || self->sum <= settings->gap * solver_or_larger(1, self->value));
}

static inline solver_before solver_before_zeros(void)
{
    return (solver_before){.by_state = {{0}}, .square = {{0}}, .linear = {0}};
}

/* The same of rows that are softened. */
static inline void solver_rows_weigh_softened(solver_rows *self, real softness)
{
    for (int i = 0; i < self->count; ++i) {
        const real yield_of_row = softness * self->multiplier[i];
        const real inverse = 1 / (self->slack[i] + yield_of_row);
        const real weight = self->multiplier[i] * inverse;
        self->inverse[i] = inverse;
        self->weight[i] = weight;
        self->dmultiplier[i] = weight * (self->residual[i] + yield_of_row);
    }
}

/* Weights of the rows, and multipliers aimed at by a step that does not centre, in dmultiplier. */
static inline void solver_rows_weigh(solver_rows *self, real left)
{
    for (int i = 0; i < self->count; ++i) {
        const real inverse = 1 / self->slack[i];
        const real weight = self->multiplier[i] * inverse;
        self->inverse[i] = inverse;
        self->weight[i] = weight;
        self->dmultiplier[i] = weight * (left * self->residual[i]);
    }
}

static inline solver_lower solver_lower_zeros(void)
{
    return (solver_lower){.blocks = {{{0}}}};
}

static inline solver_lower solver_lower_diagonal(const real *entries)
{
    solver_lower out = solver_lower_zeros();
    for (int i = 0; i < NU; ++i) {
        out.blocks[i / 4][i][i % 4] = entries[i];
    }
    return out;
}

/* M += w r r^T. */
static inline void solver_lower_add_square(solver_lower *restrict self, real w, const real *row)
{
    real parts[SOLVER_WIDE / 4][4] = {{0}};
    real factors[NU] = {0};
    for (int j = 0; j < NU; ++j) {
        parts[j / 4][j % 4] = row[j];
        factors[j] = w * row[j];
    }
    for (int block = 0; block < SOLVER_WIDE / 4; ++block) {
        for (int i = 4 * block; i < NU; ++i) {
            solver_add_multiple_4(factors[i], parts[block], self->blocks[block][i]);
        }
    }
}

/* Adds sum of w row row^T, and to sum sum of y row, of count rows. The first pairs pairs of them are opposite rows. */
static inline void solver_lower_add_rows(solver_lower *restrict self, const real *w, const real *y, real (*rows)[NU],
        int pairs, int count, real sum[restrict NU])
{
    /* Local sums stay in registers. */
    solver_lower local = *self;
    real local_sum[NU];
    memcpy(local_sum, sum, sizeof local_sum);
    for (int pair = 0; pair < pairs; ++pair) {
        const real *row = rows[2 * pair];
        solver_lower_add_square(&local, w[2 * pair] + w[2 * pair + 1], row);
        solver_add_multiple_nu(y[2 * pair] - y[2 * pair + 1], row, local_sum);
    }
    for (int i = 2 * pairs; i < count; ++i) {
        solver_lower_add_square(&local, w[i], rows[i]);
        solver_add_multiple_nu(y[i], rows[i], local_sum);
    }
    *self = local;
    memcpy(sum, local_sum, sizeof(real[NU]));
}

static inline real solver_lower_entry(solver_lower *self, int i, int j)
{
    return self->blocks[j / 4][i][j % 4];
}

/* Adds the symmetric matrix to the first block on the diagonal of another. */
static inline void solver_lower_add_to(solver_lower *self, real matrix[restrict NX][NX])
{
    for (int i = 0; i < NU; ++i) {
        for (int j = 0; j < NU; ++j) {
            const real entry = i < j ? solver_lower_entry(self, j, i) : solver_lower_entry(self, i, j);
            matrix[i][j] += entry;
        }
    }
}

/* Adds the count soft rows, with weights w and multipliers y, to gradient and Hessian by the state; the
 * slack is eliminated. */
static inline void solver_stage_add_soft_rows(solver_stage *restrict self, const real *w, const real *y,
        real (*rows)[NU], int count, real price, real by_z[restrict NU], real p[restrict NX][NX])
{
    solver_lower square = solver_lower_zeros();
    real pull[NU] = {0};
    real curvature = 0;
    real by_t = price;
    for (int i = 0; i < count; ++i) {
        curvature += w[i];
        by_t -= y[i];
        solver_add_multiple_nu(w[i], rows[i], pull);
    }
    solver_lower_add_rows(&square, w, y, rows, 0, count, by_z);
    memcpy(self->soft_pull, pull, sizeof(real[NU]));
    self->soft_inverse = 1 / (curvature + w[count]);
    self->dt = -(by_t - y[count]) * self->soft_inverse;
    for (int j = 0; j < NU; ++j) {
        by_z[j] = by_z[j] - pull[j] * self->dt;
    }
    solver_lower_add_square(&square, -self->soft_inverse, pull);
    solver_lower_add_to(&square, p);
}

/* Writes the rows, of which only the entries up to the diagonal are those of the matrix. */
static inline void solver_lower_write_rows(solver_lower *self, real out[restrict NU][SOLVER_WIDE])
{
    for (int i = 0; i < NU; ++i) {
        for (int j = 0; j < SOLVER_WIDE; ++j) {
            out[i][j] = self->blocks[j / 4][i][j % 4];
        }
    }
}

/* Adds this cost of a stage's input to its gradient and to the beginnings of its Hessians. */
static inline void solver_before_add_to(solver_before *self, solver_stage *stage, real by_v[restrict NU],
        solver_products *restrict products)
{
    real product[NU][NU] = {{0}};
    for (int i = 0; i < NU; ++i) {
        for (int j = 0; j < NX; ++j) {
            solver_add_multiple_nx(self->by_state[i][j], stage->a[j], products->hvx[i]);
            solver_add_multiple_nu(self->by_state[i][j], stage->b[j], product[i]);
        }
    }
    for (int i = 0; i < NU; ++i) {
        by_v[i] += self->linear[i];
        for (int j = 0; j <= i; ++j) {
            products->hvv[i][j] += self->square[i][j] + (product[i][j] + product[j][i]);
        }
    }
}

/* M <- L^-1 M. */
static inline void solver_solve_lower_rows_nu(real factor[NU][NU], real matrix[restrict NU][NU])
{
    for (int i = 1; i < NU; ++i) {
        for (int k = 0; k < i; ++k) {
            const real entry = factor[i][k];
            for (int j = 0; j < NU; ++j) {
                matrix[i][j] = matrix[i][j] - entry * matrix[k][j];
            }
        }
    }
}

/* out = D^-1 M. */
static inline void solver_scale_rows_nu(real factor[NU][NU], real matrix[NU][NU], real out[restrict NU][NU])
{
    for (int i = 0; i < NU; ++i) {
        for (int j = 0; j < NU; ++j) {
            out[i][j] = factor[i][i] * matrix[i][j];
        }
    }
}

/* M <- L^-T M. */
static inline void solver_solve_upper_rows_nu(real factor[NU][NU], real matrix[restrict NU][NU])
{
    for (int i = NU - 1; i >= 0; --i) {
        for (int k = i + 1; k < NU; ++k) {
            const real entry = factor[k][i];
            for (int j = 0; j < NU; ++j) {
                matrix[i][j] = matrix[i][j] - entry * matrix[k][j];
            }
        }
    }
}

/* Share of count links with multipliers y in the gradient by the input before their stage. */
static inline void solver_pull_before(const real *y, real (*earlier)[NU], int count, real by_before[restrict NU])
{
    real sum[NU] = {0};
    for (int row = 0; row < count; ++row) {
        solver_add_multiple_nu(-y[row], earlier[row], sum);
    }
    memcpy(by_before, sum, sizeof(real[NU]));
}

/* out -= factor row. */
static inline void solver_subtract_multiple_nu(real factor, const real *row, real out[restrict NU])
{
    for (int j = 0; j < NU; ++j) {
        out[j] = out[j] - factor * row[j];
    }
}

/* Subtracts the response of a stage's input from the gradient by the input before: - K_before^T h. */
static inline void solver_take_answer(real gain[NU][NU], const real *h, real by_before[restrict NU])
{
    for (int i = 0; i < NU; ++i) {
        solver_subtract_multiple_nu(h[i], gain[i], by_before);
    }
}

/* Becomes the cost of the input before a stage that was eliminated. It uses weights and multipliers of the stage's
 * count links, their rows of both stages, and the gradient h by the stage's own input. Writes the gain. */
static inline void solver_before_write(solver_before *restrict self, solver_stage *stage, real gain[restrict NU][NU],
        const real *w, const real *y, real (*own)[NU], real (*earlier)[NU], int count, const real *h)
{
    solver_lower square = solver_lower_zeros();
    real cross[NU][NU] = {{0}};
    for (int row = 0; row < count; ++row) {
        solver_lower_add_square(&square, w[row], earlier[row]);
        for (int i = 0; i < NU; ++i) {
            solver_add_multiple_nu(-(w[row] * own[row][i]), earlier[row], cross[i]);
        }
    }
    for (int j = 0; j < NU; ++j) {
        memset(self->by_state[j], 0, sizeof(real[NX]));
        for (int i = 0; i < NU; ++i) {
            solver_add_multiple_nx(-cross[i][j], stage->gain[i], self->by_state[j]);
        }
    }
    /* Y = L^-1 C, Z = D^-1 Y; N = ... - Y^T Z; K_before = L^-T Z. */
    solver_solve_lower_rows_nu(stage->factor, cross);
    solver_scale_rows_nu(stage->factor, cross, gain);
    for (int i = 0; i < NU; ++i) {
        for (int j = 0; j <= i; ++j) {
            real entry = solver_lower_entry(&square, i, j);
            for (int k = 0; k < NU; ++k) {
                entry = entry - cross[k][i] * gain[k][j];
            }
            self->square[i][j] = entry;
        }
    }
    solver_solve_upper_rows_nu(stage->factor, gain);
    solver_pull_before(y, earlier, count, self->linear);
    solver_take_answer(gain, h, self->linear);
}

/* Gains with the weights of the rows, and the constant parts of the inputs' changes for the predictor. left is
 * the remaining share of the rows' residuals. */
static inline bool solver_program_predict(solver_program *self, real left)
{
    solver_shape shape = self->shape;
    const int memory = solver_shape_memory(&shape);
    const int horizon = self->stages_len;
    const bool linked = LINKED;
    solver_before after = solver_before_zeros();
    solver_products products = solver_products_zeros();
    real p[NX][NX] = {{0}};
    real by_x[NX] = {0};
    for (int k = horizon - 1; k >= 0; --k) {
        const real *weight = solver_cost_state_at(&self->cost, k, horizon);
        const int at = solver_program_at(self, k);
        const int before = k > 0 ? solver_program_at(self, k - 1) : 0;
        solver_rows rows = solver_rows_of(self->rows + at * memory, solver_shape_rows(&shape));
        if (linked) {
            solver_rows_weigh_softened(&rows, self->links.softness);
        } else {
            solver_rows_weigh(&rows, left);
        }
        const real *w = rows.weight;
        const real *y = rows.dmultiplier;
        solver_stage *stage = &self->stages[at];
        real by_v[NU] = {0};
        for (int i = 0; i < NX; ++i) {
            p[i][i] += weight[i];
            by_x[i] += weight[i] * stage->x[i];
        }
        for (int i = 0; i < NU; ++i) {
            by_v[i] = self->cost.input[i] * stage->v[i];
        }
        solver_lower hessian = solver_lower_diagonal(self->cost.input);
        real (*input)[NU] = self->matrices.input + stage->input_rows;
        solver_lower_add_rows(&hessian, w, y, input, shape.pairs, shape.input, by_v);
        if (NU <= NX && shape.soft > 0) {
            real (*soft)[NU] = self->matrices.soft + stage->soft_rows;
            real *by_z = by_x + 0;
            const real *w_soft = w + shape.input;
            const real *y_soft = y + shape.input;
            const real price = self->cost.slack;
            solver_stage_add_soft_rows(stage, w_soft, y_soft, soft, shape.soft, price, by_z, p);
        }
        solver_products_clear_hessian(&products);
        if (linked) {
            const real *w_link = w + solver_shape_first_link(&shape);
            const real *y_link = y + solver_shape_first_link(&shape);
            real (*own)[NU] = self->links.rows + at * shape.link;
            solver_lower_add_rows(&hessian, w_link, y_link, own, 0, shape.link, by_v);
            solver_lower_write_rows(&hessian, products.hvv);
            solver_before_add_to(&after, stage, by_v, &products);
        } else {
            solver_lower_write_rows(&hessian, products.hvv);
        }
        if (!solver_eliminate(stage, p, &products)) {
            return false;
        }
        solver_stage_pull(stage, by_x, by_v);
        if (linked && k > 0) {
            real (*gain)[NU] = self->links.gains[at];
            real (*own)[NU] = self->links.rows + at * shape.link;
            real (*earlier)[NU] = self->links.rows + before * shape.link;
            const real *w_link = w + solver_shape_first_link(&shape);
            const real *y_link = y + solver_shape_first_link(&shape);
            solver_before_write(&after, stage, gain, w_link, y_link, own, earlier, shape.link, by_v);
        }
    }
    return true;
}

/* Share of the way to the boundary that a step goes at a mean complementarity. */
static inline real solver_boundary_share(real complementarity)
{
    const real margin = (real)SOLVER_MARGIN_FACTOR * complementarity;
    return margin < (real)SOLVER_MOST_MARGIN
            ? 1 - solver_or_larger((real)SOLVER_LEAST_MARGIN, margin) : 1 - (real)SOLVER_MOST_MARGIN;
}

/* The same of rows that are softened. */
static inline void solver_rows_aim_softened(solver_rows *self, real softness, real aim)
{
    for (int i = 0; i < self->count; ++i) {
        const real second = self->dslack[i] * self->dmultiplier[i];
        const real residual = self->residual[i] + softness * self->multiplier[i];
        self->dmultiplier[i] = self->weight[i] * residual + (aim - second) * self->inverse[i];
    }
}

/* Multipliers aimed at by a step that aims at this product of slacks and multipliers, from the changes of the step
 * that does not centre. */
static inline void solver_rows_aim_at(solver_rows *self, real left, real aim)
{
    for (int i = 0; i < self->count; ++i) {
        const real second = self->dslack[i] * self->dmultiplier[i];
        const real residual = left * self->residual[i];
        self->dmultiplier[i] = self->weight[i] * residual + (aim - second) * self->inverse[i];
    }
}

/* sum += sum of y row of count rows, of which so many pairs of opposite ones come first. */
static inline void solver_add_rows(const real *y, real (*rows)[NU], int pairs, int count, real sum[restrict NU])
{
    /* A local sum stays in registers. */
    real local[NU];
    memcpy(local, sum, sizeof local);
    for (int pair = 0; pair < pairs; ++pair) {
        const real both = y[2 * pair] - y[2 * pair + 1];
        solver_add_multiple_nu(both, rows[2 * pair], local);
    }
    for (int i = 2 * pairs; i < count; ++i) {
        solver_add_multiple_nu(y[i], rows[i], local);
    }
    memcpy(sum, local, sizeof(real[NU]));
}

/* Adds the rows' share, with multipliers y, of the gradient by input and state; returns that by the slack. */
static inline real solver_program_add_rows_pull(solver_program *self, int k, const real *y, real by_v[restrict NU],
        real by_x[restrict NX])
{
    solver_shape shape = self->shape;
    const bool linked = LINKED;
    solver_stage *stage = &self->stages[solver_program_at(self, k)];
    real (*input)[NU] = self->matrices.input + stage->input_rows;
    solver_add_rows(y, input, shape.pairs, shape.input, by_v);
    real by_t = 0;
    if (NU <= NX && shape.soft > 0) {
        const real *y_soft = y + shape.input;
        by_t = self->cost.slack;
        for (int i = 0; i < shape.soft; ++i) {
            by_t -= y_soft[i];
        }
        real (*soft)[NU] = self->matrices.soft + stage->soft_rows;
        real *by_z = by_x + 0;
        solver_add_rows(y_soft, soft, 0, shape.soft, by_z);
        by_t -= y_soft[shape.soft];
    }
    if (linked) {
        const real *y_link = y + solver_shape_first_link(&shape);
        solver_add_rows(y_link, solver_program_link_rows(self, k), 0, shape.link, by_v);
    }
    return by_t;
}

/* Constant parts of the inputs' changes for a step that aims at this product of slacks and multipliers, with the
 * second order of the step that does not centre. */
static inline void solver_program_pull_all(solver_program *self, real left, real aim)
{
    solver_shape shape = self->shape;
    const int horizon = self->stages_len;
    const bool linked = LINKED;
    const real softness = self->links.softness;
    real p[NX] = {0};
    real by_after[NU] = {0};
    for (int k = horizon - 1; k >= 0; --k) {
        const int at = solver_program_at(self, k);
        solver_rows rows = solver_program_rows_of(self, k);
        if (linked) {
            solver_rows_aim_softened(&rows, softness, aim);
        } else {
            solver_rows_aim_at(&rows, left, aim);
        }
        solver_stage *stage = &self->stages[at];
        const real *weight = solver_cost_state_at(&self->cost, k, horizon);
        real by_v[NU] = {0};
        for (int i = 0; i < NX; ++i) {
            p[i] += weight[i] * stage->x[i];
        }
        for (int i = 0; i < NU; ++i) {
            by_v[i] = self->cost.input[i] * stage->v[i];
        }
        const real *aims = self->rows + (at * solver_shape_memory(&shape) + 7 * solver_shape_rows(&shape));
        const real by_t = solver_program_add_rows_pull(self, k, aims, by_v, p);
        if (linked) {
            for (int i = 0; i < NU; ++i) {
                by_v[i] += by_after[i];
            }
            if (k > 0) {
                const real *y = aims + solver_shape_first_link(&shape);
                solver_pull_before(y, solver_program_link_rows(self, k - 1), shape.link, by_after);
            }
        }
        stage = &self->stages[at];
        if (NU <= NX && shape.soft > 0) {
            stage->dt = -by_t * stage->soft_inverse;
            real *by_z = p + 0;
            for (int j = 0; j < NU; ++j) {
                by_z[j] = by_z[j] - stage->soft_pull[j] * stage->dt;
            }
        }
        solver_stage_pull(stage, p, by_v);
        if (linked && k > 0) {
            solver_take_answer(self->links.gains[at], by_v, by_after);
        }
    }
}

/* Adds the response to the input before a stage to the stage's own input: - K_before v_before. */
static inline void solver_answer_before(real gain[NU][NU], const real *before, real v[restrict NU])
{
    for (int i = 0; i < NU; ++i) {
        for (int j = 0; j < NU; ++j) {
            v[i] = v[i] - gain[i][j] * before[j];
        }
    }
}

/* The same of either step, of rows that are softened. */
static inline void solver_rows_change_softened(solver_rows *self, real softness)
{
    for (int i = 0; i < self->count; ++i) {
        const real change = self->target[i];
        const real dmultiplier = self->dmultiplier[i] - self->multiplier[i] + self->weight[i] * change;
        const real dslack = softness * dmultiplier - (self->residual[i] + change);
        self->dslack[i] = dslack;
        self->dmultiplier[i] = dmultiplier;
        const real to_multiplier = -dmultiplier / self->multiplier[i];
        self->target[i] = solver_or_larger(-dslack / self->slack[i], to_multiplier);
    }
}

/* The same of a step that centres, from the multipliers aimed at in dmultiplier. */
static inline void solver_rows_change_corrected(solver_rows *self, real left)
{
    for (int i = 0; i < self->count; ++i) {
        const real change = self->target[i];
        const real dslack = -(left * self->residual[i]) - change;
        const real dmultiplier = self->dmultiplier[i] - self->multiplier[i] + self->weight[i] * change;
        self->dslack[i] = dslack;
        self->dmultiplier[i] = dmultiplier;
        const real to_slack = -dslack * self->inverse[i];
        const real to_multiplier = -dmultiplier / self->multiplier[i];
        self->target[i] = solver_or_larger(to_slack, to_multiplier);
    }
}

/* Changes of slacks and multipliers in the predictor, from the products of the rows in target. Writes to
 * target the reciprocal of the largest step that each row permits. */
static inline void solver_rows_change(solver_rows *self, real left)
{
    for (int i = 0; i < self->count; ++i) {
        const real dslack = -(left * self->residual[i]) - self->target[i];
        self->dslack[i] = dslack;
        self->dmultiplier[i] = -self->multiplier[i] - self->weight[i] * dslack;
        /* The relative changes of slack and multiplier have the sum of minus one. */
        const real to_slack = -dslack * self->inverse[i];
        self->target[i] = solver_or_larger(to_slack, 1 - to_slack);
    }
}

/* The changes of all unknowns. Before the correction the multipliers aimed at are those that make every product
 * zero to first order, so that their changes follow from those of the slacks. */
static inline solver_reach solver_program_advance(solver_program *self, real left, bool is_corrected)
{
    const int soft = self->shape.soft;
    const bool linked = LINKED;
    const real softness = self->links.softness;
    real times = 0;
    real second_sum = 0;
    real second_largest = 0;
    real dx[NX] = {0};
    real before[NU] = {0};
    for (int k = 0; k < self->stages_len; ++k) {
        const int at = solver_program_at(self, k);
        solver_stage *stage = &self->stages[at];
        real dv[NU] = {0};
        solver_stage_answer(stage, dx, dv);
        if (linked && k > 0) {
            solver_answer_before(self->links.gains[at], before, dv);
        }
        real end[NX] = {0};
        solver_add_product_nx_nx(stage->a, dx, end);
        solver_add_product_nx_nu(stage->b, dv, end);
        memcpy(dx, end, sizeof(real[NX]));
        memcpy(stage->dv, dv, sizeof(real[NU]));
        memcpy(stage->dx, dx, sizeof(real[NX]));
        if (NU <= NX && soft > 0) {
            /* Without its own share the slack's change was kept by the gradient's pass. */
            const real *z = dx + 0;
            stage->dt += solver_dot(stage->soft_pull, z) * stage->soft_inverse;
        }
        const real dt = stage->dt;
        solver_rows rows = solver_program_rows_times(self, k, before, dv, dx, dt);
        memcpy(before, dv, sizeof(real[NU]));
        if (linked) {
            solver_rows_change_softened(&rows, softness);
        } else if (is_corrected) {
            solver_rows_change_corrected(&rows, left);
        } else {
            solver_rows_change(&rows, left);
        }
        times = solver_largest_of(rows.target, rows.count, times);
        if (!is_corrected) {
            for (int i = 0; i < rows.count; ++i) {
                rows.target[i] = rows.dslack[i] * rows.dmultiplier[i];
            }
            second_sum += solver_sum_of(rows.target, rows.count);
            second_largest = solver_largest_of(rows.target, rows.count, second_largest);
        }
    }
    return (solver_reach){.times = times, .second_sum = second_sum, .second_largest = second_largest};
}

static inline void solver_program_move_by(solver_program *restrict self, real length, solver_point *restrict point)
{
    const int horizon = self->stages_len;
    const bool linked = LINKED;
    const real softness = self->links.softness;
    /* The rows are linear: each step reduces all residuals by its share. */
    const real rest = 1 - length;
    real sum = 0;
    real largest = 0;
    real value = 0;
    real residual = 0;
    for (int k = 0; k < horizon; ++k) {
        const real *weight = solver_cost_state_at(&self->cost, k, horizon);
        const int at = solver_program_at(self, k);
        solver_stage *stage = &self->stages[at];
        for (int i = 0; i < NU; ++i) {
            stage->v[i] += length * stage->dv[i];
            value += self->cost.input[i] * stage->v[i] * stage->v[i];
        }
        for (int i = 0; i < NX; ++i) {
            stage->x[i] += length * stage->dx[i];
            value += weight[i] * stage->x[i] * stage->x[i];
        }
        stage->t += length * stage->dt;
        solver_rows rows = solver_program_rows_of(self, k);
        for (int i = 0; i < rows.count; ++i) {
            rows.slack[i] += length * rows.dslack[i];
            rows.multiplier[i] += length * rows.dmultiplier[i];
            rows.target[i] = rows.slack[i] * rows.multiplier[i];
        }
        sum += solver_sum_of(rows.target, rows.count);
        largest = solver_largest_of(rows.target, rows.count, largest);
        if (linked) {
            for (int i = 0; i < rows.count; ++i) {
                rows.residual[i] = rest * rows.residual[i] + length * (softness * rows.dmultiplier[i]);
                residual = solver_or_larger(solver_magnitude(rows.residual[i]), residual);
            }
        }
    }
    point->left = rest * point->left;
    if (linked) {
        point->residual = residual;
    } else {
        point->kept = rest * point->kept;
    }
    point->sum = sum;
    point->largest = largest;
    point->value = value;
}

/* One step of Mehrotra's method; its length, negative if a Hessian is not positive definite. */
static inline real solver_program_step(solver_program *restrict self, solver_point *restrict point,
        solver_settings *settings)
{
    if (!solver_program_predict(self, point->kept)) {
        return -1;
    }
    const real count = (real)(double)(solver_shape_rows(&self->shape) * self->stages_len);
    const real complementarity = point->sum / count;
    const real share = solver_boundary_share(complementarity);
    real longest = 0;
    real aim = 0;
    /* A loop of two turns, so that the passes over the stages are compiled once. The first turn computes the
     * predictor, a step without centring; the second computes the corrector. */
    for (int turn = 0; turn < 2; ++turn) {
        const bool is_corrected = turn > 0;
        if (is_corrected) {
            solver_program_pull_all(self, point->kept, aim);
        }
        solver_reach reach = solver_program_advance(self, point->kept, is_corrected);
        longest = share / solver_or_larger(reach.times, share);
        if (!is_corrected) {
            /* The products that remain, exactly: the predictor cancels their first order. */
            const real rest = 1 - longest;
            const real square = longest * longest;
            solver_point predicted = {.left = rest * point->left, .kept = rest * point->kept,
                    .residual = point->residual, .sum = rest * point->sum + square * reach.second_sum,
                    .largest = rest * point->largest + square * reach.second_largest, .value = point->value};
            if (solver_point_is_optimal(&predicted, settings)) {
                break;
            }
            const real length = 1 / solver_or_larger(reach.times, 1);
            const real left = (1 - length) * point->sum + length * length * reach.second_sum;
            const real ratio = left / point->sum;
            aim = ratio * ratio * ratio * complementarity;
        }
    }
    solver_program_move_by(self, longest, point);
    return longest;
}

/* The larger of two; not a number if either is not. */
static inline real solver_or_kept_larger(real self, real other)
{
    return self <= other ? other : self;
}

/* Residuals of the optimality conditions at the present point, from the program's own numbers. */
static inline solver_residuals solver_program_residuals(solver_program *restrict self, const real *x0)
{
    const int horizon = self->stages_len;
    const bool linked = LINKED;
    solver_shape shape = self->shape;
    real primal = 0;
    real dual = 0;
    real gap = 0;
    real value = 0;
    real size = 1;
    real multipliers = 1;
    real x_before[NX];
    memcpy(x_before, x0, sizeof x_before);
    real v_before[NU] = {0};
    for (int k = 0; k < horizon; ++k) {
        solver_stage *stage = &self->stages[solver_program_at(self, k)];
        real v[NU];
        memcpy(v, stage->v, sizeof v);
        real x[NX];
        memcpy(x, stage->x, sizeof x);
        const real t = stage->t;
        real end[NX] = {0};
        solver_stage_end(stage, x_before, v, end);
        for (int i = 0; i < NX; ++i) {
            primal = solver_or_kept_larger(solver_magnitude(end[i] - x[i]), primal);
            size = solver_or_kept_larger(solver_magnitude(x[i]), size);
        }
        solver_rows rows = solver_program_rows_times(self, k, v_before, v, x, t);
        memcpy(x_before, x, sizeof(real[NX]));
        memcpy(v_before, v, sizeof(real[NU]));
        for (int i = 0; i < rows.count; ++i) {
            const real room = rows.bound[i] - rows.target[i];
            const real multiplier = rows.multiplier[i];
            primal = solver_or_kept_larger(-room, primal);
            dual = solver_or_kept_larger(-multiplier, dual);
            multipliers = solver_or_kept_larger(multiplier, multipliers);
            gap += multiplier * room;
        }
    }
    real p[NX] = {0};
    real by_before[NU] = {0};
    for (int k = horizon - 1; k >= 0; --k) {
        const real *weight = solver_cost_state_at(&self->cost, k, horizon);
        const int at = solver_program_at(self, k);
        solver_stage *stage = &self->stages[at];
        real by_v[NU] = {0};
        for (int i = 0; i < NU; ++i) {
            by_v[i] = self->cost.input[i] * stage->v[i];
            value += by_v[i] * stage->v[i];
        }
        for (int i = 0; i < NX; ++i) {
            const real pulled = weight[i] * stage->x[i];
            multipliers = solver_or_kept_larger(solver_magnitude(pulled), multipliers);
            value += pulled * stage->x[i];
            p[i] += pulled;
        }
        const real *y = self->rows + (at * solver_shape_memory(&shape) + 2 * solver_shape_rows(&shape));
        const real by_t = solver_program_add_rows_pull(self, k, y, by_v, p);
        if (linked) {
            for (int i = 0; i < NU; ++i) {
                by_v[i] += by_before[i];
            }
            if (k > 0) {
                const real *y_link = y + solver_shape_first_link(&shape);
                solver_pull_before(y_link, solver_program_link_rows(self, k - 1), shape.link, by_before);
            }
        }
        dual = solver_or_kept_larger(solver_magnitude(by_t), dual);
        solver_add_transposed_nx_nu(stage->b, p, by_v);
        for (int i = 0; i < NU; ++i) {
            dual = solver_or_kept_larger(solver_magnitude(by_v[i]), dual);
        }
        real next[NX] = {0};
        solver_add_transposed_nx_nx(stage->a, p, next);
        memcpy(p, next, sizeof(real[NX]));
    }
    return (solver_residuals){.primal = primal / size, .dual = dual / multipliers,
            .gap = solver_magnitude(gap) / solver_or_kept_larger(value, 1)};
}

/* Whether all are numbers of at most limit. */
static inline bool solver_residuals_within(solver_residuals *self, real limit)
{
    return self->primal <= limit && self->dual <= limit && self->gap <= limit;
}

/* Solves the program from an initial state, with the gains of Program::prepare for the present stages.
 *
 * is_warm means that inputs and multipliers are a guess at the solution, such as the last solution shifted by a
 * stage. */
static inline solver_report solver_program_solve(solver_program *restrict self, const real *x0, bool is_warm,
        solver_settings *settings)
{
    const real worst = solver_program_follow_gains(self, x0);
    if (!solver_is_finite_number(worst)) {
        return solver_failure(0);
    }
    int iterations = 0;
    bool is_capped = false;
    if (worst <= settings->tolerance) {
        solver_program_take_gains(self);
    } else {
        solver_program_start(self, x0, is_warm);
        const bool is_far = solver_program_change_of_gains(self) > (real)SOLVER_FAR_CHANGE;
        solver_centring smallest = SOLVER_COLD;
        if (is_warm) {
            smallest = is_far ? SOLVER_FAR : SOLVER_WARM;
        }
        bool may_restart = is_warm;
        bool must_centre = true;
        solver_point point = solver_point_zeros();
        for (;;) {
            /* First points and restarts are centred in one place, so that the pass is compiled once. */
            if (must_centre) {
                point = solver_program_centre(self, smallest);
                must_centre = false;
            }
            if (!solver_is_finite_number(solver_point_infeasibility(&point) + point.sum)) {
                return solver_failure(iterations);
            }
            if (solver_point_is_optimal(&point, settings)) {
                break;
            }
            if (iterations >= settings->max_iterations) {
                is_capped = true;
                break;
            }
            iterations += 1;
            const real length = solver_program_step(self, &point, settings);
            if (length < 0) {
                /* Rounding prevents further progress: the residuals decide whether the point is accepted. */
                break;
            }
            if ((may_restart && length < (real)SOLVER_SHORT_STEP) || iterations % SOLVER_PATIENCE == 0) {
                smallest = SOLVER_AGAIN;
                must_centre = true;
            }
            may_restart = false;
        }
    }
    solver_residuals residuals = solver_program_residuals(self, x0);
    solver_outcome outcome = is_capped
            ? SOLVER_ITERATION_CAP : solver_residuals_within(&residuals, settings->accepted_residual)
            ? SOLVER_SOLVED : SOLVER_INACCURATE;
    return (solver_report){.outcome = outcome, .iterations = iterations, .residuals = residuals};
}

