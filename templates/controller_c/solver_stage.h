/* @generated from src/control/solver by `cargo run -p romc-translate`: types of the structured solver.
 * Names that are defined elsewhere: real, the type of numbers; NX and NU, how many states and inputs there are. */

/* One stage: its dynamics, where its rows stand, and the memory of the solver.
 *
 * NX states and NU inputs; a and b are row-major. */
typedef struct {
    /* State by the state before. */
    real a[NX][NX];
    /* State by the input. */
    real b[NX][NU];
    /* Constant part of the state. */
    real c[NX];
    /* First of this stage's rows in RowMatrices::input. */
    int input_rows;
    /* First of this stage's rows in RowMatrices::soft. */
    int soft_rows;
    /* Input of the last solution. */
    real v[NU];
    /* State at the stage's end in the last solution. */
    real x[NX];
    /* Slack of the soft rows in the last solution. */
    real t;
    real gain[NU][NX];
    real feed[NU];
    /* L D L^T of the input's Hessian: L below the diagonal, inverse of D on it. */
    real factor[NU][NU];
    real dv[NU];
    real dx[NX];
    real dt;
    /* sum of w_j E_j of the soft rows and the inverse of the slack's own curvature. */
    real soft_pull[NU];
    real soft_inverse;
    /* Input of the optimum without rows, of the last program. */
    real plain[NU];
} solver_stage;

