//! Wrong recordings are reported, right ones are not.

use nalgebra::DMatrix;
use romc::recording::mismatch::{mismatches, notes};
use romc::recording::{self, Recording, Segment};
use romc::robot::Leg;

use crate::outside;
use crate::real_jumps::jumps_in;
use crate::tools::thorough_or;

/// A way to spoil a recording.
type Spoil = fn(&mut Segment);

const DEGREES: f64 = 180.0 / std::f64::consts::PI;

/// Multiplies rows of position, velocity and acceleration by a factor.
fn scale(segment: &mut Segment, rows: impl IntoIterator<Item = usize>, factor: f64) {
    for row in rows {
        for matrix in [&mut segment.x, &mut segment.dx, &mut segment.ddx] {
            matrix.row_mut(row).scale_mut(factor);
        }
    }
}

fn swap(segment: &mut Segment, one: usize, other: usize) {
    for matrix in [&mut segment.x, &mut segment.dx, &mut segment.ddx] {
        matrix.swap_rows(one, other);
    }
}

/// Exchanges all columns of two legs.
fn swap_legs(segment: &mut Segment, one: Leg, other: Leg) {
    let (a, b) = (one.index(), other.index());
    for joint in 0..3 {
        swap(segment, 3 * a + joint, 3 * b + joint);
        segment.torque_nm.swap_rows(3 * a + joint, 3 * b + joint);
    }
    segment.feet.iter_mut().for_each(|feet| feet.swap(a, b));
}

fn joints(kind: usize) -> impl Iterator<Item = usize> {
    (0..12).filter(move |joint| joint % 3 == kind)
}

/// Ways to make a right recording wrong.
const SPOILED: [(&str, Spoil); 30] = [
    ("joint and body angles in degrees", |s| {
        scale(s, (0..12).chain(15..18), DEGREES);
    }),
    ("body angles in degrees", |s| scale(s, 15..18, DEGREES)),
    ("millimetres", |s| scale(s, 12..15, 1e3)),
    ("torques in kN m", |s| s.torque_nm *= 1e-3),
    ("torques tenfold", |s| s.torque_nm *= 10.0),
    ("torques negated", |s| s.torque_nm *= -1.0),
    ("torques zero", |s| s.torque_nm *= 0.0),
    ("knees negated", |s| scale(s, joints(2), -1.0)),
    ("hips' flexion negated with its torque", |s| {
        scale(s, joints(1), -1.0);
        joints(1).for_each(|joint| s.torque_nm.row_mut(joint).scale_mut(-1.0));
    }),
    ("body z negated", |s| scale(s, [14], -1.0)),
    ("pitch negated", |s| scale(s, [16], -1.0)),
    ("velocities doubled", |s| s.dx *= 2.0),
    ("velocities negated", |s| s.dx *= -1.0),
    ("vertical acceleration and 9.81", |s| {
        s.ddx.row_mut(14).add_scalar_mut(9.81);
    }),
    ("fr and fl exchanged", |s| {
        swap_legs(s, Leg::FrontRight, Leg::FrontLeft);
    }),
    ("fr and rr exchanged", |s| {
        swap_legs(s, Leg::FrontRight, Leg::RearRight);
    }),
    ("front and rear exchanged", |s| {
        swap_legs(s, Leg::FrontRight, Leg::RearRight);
        swap_legs(s, Leg::FrontLeft, Leg::RearLeft);
    }),
    ("left and right exchanged", |s| {
        swap_legs(s, Leg::FrontRight, Leg::FrontLeft);
        swap_legs(s, Leg::RearRight, Leg::RearLeft);
    }),
    ("columns of the feet rotated", |s| {
        s.feet.iter_mut().for_each(|feet| feet.rotate_left(1));
    }),
    ("feet 60 samples late", |s| {
        let first = s.feet[0];
        s.feet.rotate_right(60);
        s.feet[..60].fill(first);
    }),
    ("feet inverted", |s| {
        let feet = s.feet.iter_mut().flatten();
        feet.for_each(|foot| *foot = !*foot);
    }),
    ("body 3 m ahead", |s| s.x.row_mut(12).add_scalar_mut(3.0)),
    ("body turned by a right angle", |s| {
        s.x.row_mut(17).add_scalar_mut(90.0 / DEGREES);
        swap(s, 12, 13);
        scale(s, [12], -1.0);
    }),
    ("height from where the body stood", |s| {
        s.x.row_mut(14).add_scalar_mut(-0.3);
    }),
    ("feet always down", |s| s.feet.fill([true; 4])),
    ("body x and z exchanged", |s| swap(s, 12, 14)),
    ("body x and y exchanged", |s| swap(s, 12, 13)),
    ("body x backwards", |s| scale(s, [12], -1.0)),
    ("flexion and knee exchanged", |s| {
        for joint in joints(1) {
            swap(s, joint, joint + 1);
            s.torque_nm.swap_rows(joint, joint + 1);
        }
    }),
    ("rows in reverse order", |s| {
        for matrix in [&mut s.x, &mut s.dx, &mut s.ddx, &mut s.torque_nm] {
            let n = matrix.ncols();
            *matrix = DMatrix::from_fn(matrix.nrows(), n, |row, j| matrix[(row, n - 1 - j)]);
        }
        s.feet.reverse();
    }),
];

fn spoiled(right: &Recording, spoil: Spoil) -> Recording {
    let mut wrong = right.clone();
    wrong.segments.iter_mut().for_each(spoil);
    wrong
}

/// Folders of shipped recordings and their robots.
const RIGHT: [(&str, &str, usize); 4] = [
    ("go1", "go1", 20),
    ("go1-other", "go1", 8),
    ("go1-noisy", "go1", 5),
    ("go2-asynchronous", "go2", 10),
];

/// The same for walks.
const WALKS: [(&str, &str, usize); 3] = [
    ("go1-trot", "go1", 18),
    ("go1-trot-other", "go1", 6),
    ("go1-gaits", "go1", 6),
];

#[test]
fn no_right_recording_has_a_note() {
    for (folder, robot, least) in RIGHT.into_iter().chain(WALKS) {
        let robot = romc::robot_file::by_name(robot).unwrap();
        for path in jumps_in(folder, least)
            .into_iter()
            .step_by(thorough_or(1, 3))
        {
            let right = recording::read(&path).unwrap();
            assert_eq!(notes(&right, robot), [""; 0], "{}", path.display());
        }
    }
}

#[test]
fn wrong_readings_of_every_jump_are_noticed() {
    let (mut missed, mut made) = (Vec::new(), 0);
    for (folder, robot, least) in RIGHT {
        let robot = romc::robot_file::by_name(robot).unwrap();
        for path in jumps_in(folder, least)
            .into_iter()
            .step_by(thorough_or(1, 3))
        {
            let right = recording::read(&path).unwrap();
            let mut require = |name: &str, found: Vec<String>| {
                made += 1;
                if found.is_empty() {
                    missed.push(format!("{name}: {}", path.display()));
                }
            };
            for (name, spoil) in SPOILED {
                require(name, notes(&spoiled(&right, spoil), robot));
            }
            let other = if robot.name == "go1" { "go2" } else { "go1" };
            require(
                other,
                notes(&right, romc::robot_file::by_name(other).unwrap()),
            );
        }
    }
    println!("{} of {made} missed:\n{}", missed.len(), missed.join("\n"));
    // Two jumps whose feet leave the ground almost at once do not determine which column belongs to which foot.
    let of_feet = |missed: &String| missed.starts_with("columns of the feet");
    assert!(missed.len() <= 2 && missed.iter().all(of_feet));
}

#[test]
fn real_jumps_have_no_mismatch() {
    let mut jumps: Vec<_> = (outside::hardware_jump().into_iter())
        .map(|path| (path, "go1"))
        .collect();
    if let Some(folder) = outside::beside("a1") {
        let entries = std::fs::read_dir(folder).unwrap();
        let paths = entries.map(|entry| entry.unwrap().path());
        let recordings = paths.filter(|path| path.extension().is_some_and(|end| end == "gz"));
        jumps.extend(recordings.map(|path| (path, "a1")));
    }
    for (path, robot) in jumps {
        let jump = recording::read(&path).unwrap();
        let mut found = mismatches(&jump, romc::robot_file::by_name(robot).unwrap());
        // Their torques do not include all forces that moved them.
        found.retain(|found| found.kind != "carried");
        assert!(found.is_empty(), "{}: {found:?}", path.display());
    }
}

/// The only note on a recording spoiled in this way.
fn note_of(spoil: impl Fn(&mut Segment)) -> String {
    let right = recording::read(&jumps_in("go1", 20)[0]).unwrap();
    let mut wrong = right;
    wrong.segments.iter_mut().for_each(spoil);
    notes(&wrong, romc::robot_file::by_name("go1").unwrap()).join("\n")
}

#[test]
fn rates_in_other_units_are_named_with_their_factor() {
    for (rows, factor, words) in [
        (15..18, DEGREES, "`unit = \"deg/s\"`"),
        (0..12, DEGREES, "velocities of the joints are 57.3"),
        (12..15, 1e3, "`unit = \"mm/s\"`"),
        (0..12, -1.0, "the other sign"),
    ] {
        let found = note_of(|s| {
            for row in rows.clone() {
                s.dx.row_mut(row).scale_mut(factor);
            }
        });
        assert!(found.contains(words), "{found}");
    }
}

#[test]
fn a_robot_that_lies_on_the_ground_is_no_jump() {
    // It topples over after the landing.
    let found = note_of(|s| {
        let n = s.len();
        for i in n - 150..n {
            let share = (i + 150 - n) as f64 / 149.0;
            s.x[(16, i)] += 1.5 * share;
            s.x[(14, i)] = 0.3 - 0.5 * share;
        }
    });
    assert!(found.contains("did the robot fall?"), "{found}");
}

#[test]
fn a_quaternion_in_another_order_is_named() {
    let turned = |order: [usize; 4]| {
        note_of(|s| {
            for i in 0..s.len() {
                let about = |axis: usize| {
                    nalgebra::UnitQuaternion::from_scaled_axis(nalgebra::Vector3::ith(
                        axis,
                        s.x[(15 + axis, i)],
                    ))
                };
                let q = about(2) * about(1) * about(0);
                let q = [q.w, q.i, q.j, q.k];
                let [w, x, y, z] = order.map(|at| q[at]);
                s.x[(15, i)] = (2.0 * (y * z + w * x)).atan2(1.0 - 2.0 * (x * x + y * y));
                s.x[(16, i)] = (2.0 * (w * y - x * z)).clamp(-1.0, 1.0).asin();
                s.x[(17, i)] = (2.0 * (x * y + w * z)).atan2(1.0 - 2.0 * (y * y + z * z));
            }
        })
    };
    // A log in xyzw read as wxyz, and the reverse.
    for (order, words) in [
        ([1, 2, 3, 0], "xyzw instead of wxyz"),
        ([3, 0, 1, 2], "wxyz instead of xyzw"),
    ] {
        let found = turned(order);
        assert!(found.contains(words), "{found}");
        assert!(!found.contains("columns of the feet"), "{found}");
    }
}
