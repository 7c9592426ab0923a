//! Solutions of the conic solver against references that do not share its method.

use clarabel::algebra::CscMatrix;
use nalgebra::{DMatrix, DVector};
use romc::mpc::{Cone, ConeProgram, Outcome, QpSettings, QpSolver, sparse};

use crate::random::Random;

fn upper(matrix: &DMatrix<f64>) -> CscMatrix<f64> {
    filled(&matrix.upper_triangle(), |row, col| row <= col)
}

fn full(matrix: &DMatrix<f64>) -> CscMatrix<f64> {
    filled(matrix, |_, _| true)
}

fn filled(matrix: &DMatrix<f64>, is_in: fn(usize, usize) -> bool) -> CscMatrix<f64> {
    let (n_rows, n_cols) = matrix.shape();
    let places = (0..n_cols).flat_map(|col| (0..n_rows).map(move |row| (row, col)));
    let entries: Vec<_> = (places.filter(|&(row, col)| is_in(row, col)))
        .map(|(row, col)| (row, col, matrix[(row, col)]))
        .collect();
    sparse(n_rows, n_cols, &entries)
}

fn program(
    p: &DMatrix<f64>,
    q: &[f64],
    a: &DMatrix<f64>,
    b: &[f64],
    cones: Vec<Cone>,
) -> ConeProgram {
    ConeProgram {
        p: upper(p),
        q: q.to_vec(),
        a: full(a),
        b: b.to_vec(),
        cones,
    }
}

/// The optimum of a strictly convex program with `a x <= b` by trying every active set.
fn by_enumeration(
    p: &DMatrix<f64>,
    q: &DVector<f64>,
    a: &DMatrix<f64>,
    b: &DVector<f64>,
) -> DVector<f64> {
    let (n, m) = (p.nrows(), a.nrows());
    for active in 0u32..1 << m {
        let rows: Vec<usize> = (0..m).filter(|row| active >> row & 1 == 1).collect();
        if rows.len() > n {
            continue;
        }
        let size = n + rows.len();
        let mut kkt = DMatrix::zeros(size, size);
        let mut rhs = DVector::zeros(size);
        kkt.view_mut((0, 0), (n, n)).copy_from(p);
        rhs.rows_mut(0, n).copy_from(&-q);
        for (i, &row) in rows.iter().enumerate() {
            for col in 0..n {
                kkt[(n + i, col)] = a[(row, col)];
                kkt[(col, n + i)] = a[(row, col)];
            }
            rhs[n + i] = b[row];
        }
        let Some(point) = kkt.lu().solve(&rhs) else {
            continue;
        };
        let x = point.rows(0, n).into_owned();
        let feasible = (a * &x - b).max() < 1e-9;
        let signs_right = point
            .rows(n, rows.len())
            .iter()
            .all(|&multiplier| multiplier > -1e-9);
        if feasible && signs_right {
            return x;
        }
    }
    panic!("a strictly convex feasible program has an optimal active set");
}

/// Tight enough that points, and not only costs, can be compared.
fn tight() -> QpSettings {
    QpSettings {
        tolerance: 1e-10,
        ..QpSettings::default()
    }
}

fn random_program(
    random: &mut Random,
    n: usize,
    m: usize,
) -> (DMatrix<f64>, DVector<f64>, DMatrix<f64>, DVector<f64>) {
    let root = DMatrix::from_fn(n, n, |_, _| random.signed());
    let p = &root * root.transpose() + DMatrix::identity(n, n) * 0.3;
    let q = DVector::from_fn(n, |_, _| 2.0 * random.signed());
    let a = DMatrix::from_fn(m, n, |_, _| random.signed());
    let b = DVector::from_fn(m, |_, _| 0.1 + 0.3 * random.signed().abs());
    (p, q, a, b)
}

#[test]
fn random_quadratic_programs_match_enumeration_of_active_sets() {
    let mut random = Random::new(11);
    let (n, m) = (4, 7);
    let (p, q, a, b) = random_program(&mut random, n, m);
    let first = program(
        &p,
        q.as_slice(),
        &a,
        b.as_slice(),
        vec![Cone::Nonnegative(m)],
    );
    let mut solver = QpSolver::new(first, tight()).expect("well-formed program");
    let mut with_active_rows = 0;
    for _ in 0..60 {
        let (p, q, a, b) = random_program(&mut random, n, m);
        *solver.program_mut() = program(
            &p,
            q.as_slice(),
            &a,
            b.as_slice(),
            vec![Cone::Nonnegative(m)],
        );
        assert_eq!(solver.solve(), Outcome::Solved);
        let expected = by_enumeration(&p, &q, &a, &b);
        for (found, expected) in solver.solution().iter().zip(expected.iter()) {
            assert!(
                (found - expected).abs() < 1e-7,
                "{found} instead of {expected}"
            );
        }
        with_active_rows += usize::from((&a * &expected - &b).max() > -1e-9);
    }
    assert!(
        with_active_rows > 30,
        "only {with_active_rows} programs had an active row"
    );
}

#[test]
fn second_order_cone_projection_matches_the_closed_form() {
    let mut random = Random::new(5);
    let identity = DMatrix::identity(3, 3);
    let cones = vec![Cone::SecondOrder(3)];
    for _ in 0..40 {
        let point = [random.normal(), random.normal(), random.normal()];
        let q = point.map(|value| -value);
        let mut solver = QpSolver::new(
            program(&identity, &q, &(-&identity), &[0.0; 3], cones.clone()),
            QpSettings::default(),
        )
        .expect("well-formed program");
        assert_eq!(solver.solve(), Outcome::Solved);
        let tail = point[1].hypot(point[2]);
        let expected = if tail <= point[0] {
            point
        } else if tail <= -point[0] {
            [0.0; 3]
        } else {
            let head = 0.5 * (point[0] + tail);
            [head, head * point[1] / tail, head * point[2] / tail]
        };
        for (found, expected) in solver.solution().iter().zip(expected) {
            assert!(
                (found - expected).abs() < 1e-4,
                "{found} instead of {expected}"
            );
        }
    }
}

#[test]
fn equality_rows_hold_at_the_solution() {
    let p = DMatrix::identity(3, 3);
    let a = DMatrix::from_row_slice(1, 3, &[1.0, 2.0, 2.0]);
    let mut solver = QpSolver::new(
        program(&p, &[0.0; 3], &a, &[9.0], vec![Cone::Zero(1)]),
        QpSettings::default(),
    )
    .expect("well-formed program");
    assert_eq!(solver.solve(), Outcome::Solved);
    for (found, expected) in solver.solution().iter().zip([1.0, 2.0, 2.0]) {
        assert!((found - expected).abs() < 1e-5);
    }
    assert!((solver.multipliers()[0] + 1.0).abs() < 1e-5);
}

fn one_variable(quadratic: f64, q: f64, rows: &[f64], b: &[f64]) -> QpSolver {
    let a = DMatrix::from_row_slice(rows.len(), 1, rows);
    QpSolver::new(
        program(
            &DMatrix::from_element(1, 1, quadratic),
            &[q],
            &a,
            b,
            vec![Cone::Nonnegative(rows.len())],
        ),
        tight(),
    )
    .expect("well-formed program")
}

#[test]
fn contradicting_rows_are_infeasible_and_a_mended_program_is_solved_again() {
    let mut solver = one_variable(1.0, 0.0, &[1.0, -1.0], &[0.0, -1.0]);
    assert_eq!(solver.solve(), Outcome::Infeasible);
    solver.program_mut().b[1] = 1.0;
    assert_eq!(solver.solve(), Outcome::Solved);
    assert!(solver.solution()[0].abs() < 2e-5, "{:?}", solver.solution());
}

#[test]
fn cost_without_lower_bound_is_unbounded() {
    assert_eq!(
        one_variable(0.0, 1.0, &[1.0], &[0.0]).solve(),
        Outcome::Unbounded
    );
}

#[test]
fn data_that_is_not_a_number_is_a_numerical_failure_and_leaves_the_solver_usable() {
    let mut solver = one_variable(1.0, -3.0, &[1.0], &[2.0]);
    solver.program_mut().q[0] = f64::NAN;
    assert_eq!(solver.solve(), Outcome::NumericalFailure);
    solver.program_mut().q[0] = -3.0;
    assert_eq!(solver.solve(), Outcome::Solved);
    assert!((solver.solution()[0] - 2.0).abs() < 1e-5);
}

#[test]
fn iteration_cap_of_two_is_reported() {
    let mut random = Random::new(3);
    let (p, q, a, b) = random_program(&mut random, 5, 9);
    let settings = QpSettings {
        max_iterations: 2,
        ..QpSettings::default()
    };
    let cones = vec![Cone::Nonnegative(9)];
    let mut solver = QpSolver::new(
        program(&p, (q * 50.0).as_slice(), &a, b.as_slice(), cones),
        settings,
    )
    .expect("well-formed program");
    assert_eq!(solver.solve(), Outcome::IterationCap);
    assert_eq!(solver.iterations(), 2);
}

#[test]
fn residuals_beyond_what_is_accepted_are_inaccurate_whatever_the_solver_says() {
    let settings = QpSettings {
        accepted_residual: 1e-30,
        ..QpSettings::default()
    };
    let mut random = Random::new(8);
    let (p, q, a, b) = random_program(&mut random, 4, 6);
    let mut solver = QpSolver::new(
        program(
            &p,
            q.as_slice(),
            &a,
            b.as_slice(),
            vec![Cone::Nonnegative(6)],
        ),
        settings,
    )
    .expect("well-formed program");
    assert_eq!(solver.solve(), Outcome::Inaccurate);
    assert!(solver.residuals().worst() < 1e-5);
}

#[test]
fn sizes_that_disagree_are_refused() {
    let a = DMatrix::identity(2, 2);
    let wrong = program(
        &DMatrix::identity(2, 2),
        &[0.0; 2],
        &a,
        &[0.0; 2],
        vec![Cone::Nonnegative(3)],
    );
    let error =
        QpSolver::new(wrong, QpSettings::default()).expect_err("three rows of cone, two of matrix");
    assert!(error.to_string().contains("cones"), "{error}");
}

#[test]
fn entries_named_twice_exist_once_and_add_up() {
    let entries = [(1, 2, 5.0), (0, 0, 2.0), (1, 0, -1.0), (0, 0, 0.5)];
    let mut matrix = sparse(2, 3, &entries);
    assert_eq!(matrix.colptr, [0, 2, 2, 3]);
    assert_eq!(matrix.rowval, [0, 1, 1]);
    assert_eq!(matrix.nzval, [2.5, -1.0, 5.0]);
    matrix.set_entry((1, 2), 7.0);
    assert_eq!(matrix.nzval, [2.5, -1.0, 7.0]);
}
