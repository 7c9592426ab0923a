//! Tests of a model against known physics, from its file alone: invariance to shifts, gravity, mass, mirror symmetry. A
//! state is the posture decoded from `z = 0`, at rest and at 1 m/s along x, y and z; the input is the phase's mean.

use super::*;

const SHIFT_M: f64 = 0.3;
const OFF_RAD: f64 = 0.1;
/// Largest part of another body coordinate in the height of a centre of mass.
const PURE: f64 = 1e-6;
/// Share of the inputs' effect in flight below which a combination is a momentum.
const KEPT: f64 = 1e-3;
const PITCH: usize = BODY_X + 4;
/// Entries of a wrench: the vertical force, the moment of pitch.
const LIFT: usize = 2;
const MOMENT: usize = 4;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Invariance {
    /// Of the latent combination that is body z and joints alone; none without one, or without a flight phase.
    pub gravity_m_s2: Option<f64>,
    /// Vertical force of four feet over the acceleration of that combination.
    pub mass_kg: Option<f64>,
    /// Acceleration of the rotation about the centre of mass by the feet's moment of pitch; none without such a latent.
    pub rotation_rad_s2_per_nm: Option<f64>,
    /// Largest change of a decoded joint angle for a body 1 m further on, rad/m.
    pub joint_shift_rad_m: f64,
    pub phases: Vec<PhaseInvariance>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PhaseInvariance {
    pub phase: String,
    /// Change of the body's acceleration for a robot 0.3 m further on, (m/s^2)/m.
    pub shift_x: f64,
    pub shift_y: f64,
    /// Largest difference between a state with one joint displaced by 0.1 rad and its mirror image, m/s^2.
    pub mirror_asymmetry: f64,
}

impl Invariance {
    /// `None` without encoder, decoder, scaling or robot.
    pub fn of(model: &ReducedModel) -> Result<Option<Self>, ModelError> {
        match Self::of_complete(model) {
            Err(ModelError::Missing { .. }) => Ok(None),
            invariance => invariance.map(Some),
        }
    }

    fn of_complete(model: &ReducedModel) -> Result<Self, ModelError> {
        let rest = model.decode(&DVector::zeros(model.latent_dim()))?;
        model.robot()?;
        let phases = 0..model.phases().len();
        let phases = phases.map(|phase| Probe::new(model, phase, &rest).invariance());
        let height = momentum(model, &rest, BODY_Z)?;
        let gravity_m_s2 = height
            .as_ref()
            .and_then(|(_, in_flight)| Some(-(*in_flight)?[0]));
        let by = |combination: Option<DVector<f64>>, load| match combination {
            Some(combination) => response(model, &rest, &combination, load),
            None => Ok(None),
        };
        let mass_kg = by(height.map(|(combination, _)| combination), LIFT)?.map(|by| 1.0 / by);
        let is_kept = |in_flight: &Option<[f64; 2]>| in_flight.is_none_or(|[_, by]| by < KEPT);
        let rotation = momentum(model, &rest, PITCH)?.filter(|(_, in_flight)| is_kept(in_flight));
        let rotation = rotation.map(|(combination, _)| combination);
        let mut moved = rest.clone();
        moved[BODY_X] += SHIFT_M;
        let decoded = |x: &DVector<f64>| model.decode(&model.encode(x)?);
        let change = decoded(&moved)? - decoded(&rest)?;
        Ok(Self {
            joint_shift_rad_m: change.rows(0, JOINT_DIM).amax() / SHIFT_M,
            gravity_m_s2: gravity_m_s2.filter(|value| value.is_finite()),
            mass_kg: mass_kg.filter(|mass| mass.is_finite()),
            rotation_rad_s2_per_nm: by(rotation, MOMENT)?,
            phases: phases.collect::<Result<_, _>>()?,
        })
    }
}

/// A phase, the posture of `z = 0`, and the phase's mean training input (zero if the model has none), SI.
struct Probe<'m> {
    model: &'m ReducedModel,
    phase: usize,
    rest: &'m DVector<f64>,
    input: DVector<f64>,
}

impl<'m> Probe<'m> {
    fn new(model: &'m ReducedModel, phase: usize, rest: &'m DVector<f64>) -> Self {
        let statistics = model.input_statistics(phase);
        Self {
            model,
            phase,
            rest,
            input: statistics.map_or(DVector::zeros(STATE_DIM), |known| known.mean.clone()),
        }
    }

    /// Latent acceleration, scaled units, at a state and an input of the robot, SI.
    fn ddz(&self, [x, dx, u]: [&DVector<f64>; 3]) -> Result<DVector<f64>, ModelError> {
        let tangent = self.model.tangent(x)?;
        let (dz, u_lat) = (&tangent.encode * dx, &tangent.project * u);
        (self.model).ddz(self.phase, &self.model.encode(x)?, &dz, &u_lat)
    }

    fn ddz_at_rest(&self, u: &DVector<f64>) -> Result<DVector<f64>, ModelError> {
        self.ddz([self.rest, &DVector::zeros(STATE_DIM), u])
    }

    fn invariance(&self) -> Result<PhaseInvariance, ModelError> {
        let (model, rest, input) = (self.model, self.rest, &self.input);
        // Linear acceleration of the body, m/s^2.
        let accelerated = |x: &DVector<f64>, dx: &DVector<f64>, u: &DVector<f64>| {
            let decoder = model.decoder_jacobian(&model.encode(x)?)?;
            Ok::<_, ModelError>(decoder.rows(BODY_X, 3) * self.ddz([x, dx, u])?)
        };
        let mut shifts = [0.0_f64; 2];
        for velocity in velocities() {
            let here = accelerated(rest, &velocity, input)?;
            for (axis, shift) in shifts.iter_mut().enumerate() {
                let mut moved = rest.clone();
                moved[BODY_X + axis] += SHIFT_M;
                let there = accelerated(&moved, &velocity, input)?;
                *shift = larger(*shift, (there - &here).norm() / SHIFT_M);
            }
        }
        let mut mirror_asymmetry = 0.0_f64;
        for (joint, moving) in (0..JOINT_DIM).flat_map(|joint| [(joint, false), (joint, true)]) {
            let (mut x, mut dx) = (rest.clone(), DVector::zeros(STATE_DIM));
            let off = if moving { &mut dx } else { &mut x };
            off[joint] += OFF_RAD;
            let seen = accelerated(&x, &dx, input)?;
            let image = accelerated(&mirrored(&x), &mirrored(&dx), &mirrored(input))?;
            let difference = (seen[0] - image[0]).hypot(seen[2] - image[2]);
            mirror_asymmetry = larger(mirror_asymmetry, difference);
        }
        let [shift_x, shift_y] = shifts;
        Ok(PhaseInvariance {
            phase: model.phases()[self.phase].name.clone(),
            shift_x,
            shift_y,
            mirror_asymmetry,
        })
    }

    /// By how much `ddz` changes with each of `(z, dz, u_lat)`, `latent_dim x 3 latent_dim`, over a unit.
    fn gain(&self, ddz: &DVector<f64>) -> Result<DMatrix<f64>, ModelError> {
        let (model, d) = (self.model, self.model.latent_dim());
        let u_lat = &model.tangent(self.rest)?.project * &self.input;
        let z = model.encode(self.rest)?;
        let mut out = DMatrix::zeros(d, 3 * d);
        for column in 0..3 * d {
            let mut point = [z.clone(), DVector::zeros(d), u_lat.clone()];
            point[column / d][column % d] += 1.0;
            let [z, dz, u_lat] = &point;
            out.set_column(column, &(model.ddz(self.phase, z, dz, u_lat)? - ddz));
        }
        Ok(out)
    }
}

fn larger(one: f64, other: f64) -> f64 {
    if other.is_nan() || other > one {
        other
    } else {
        one
    }
}

fn velocities() -> [DVector<f64>; 4] {
    std::array::from_fn(|index| {
        let mut dx = DVector::zeros(STATE_DIM);
        if let Some(axis) = index.checked_sub(1) {
            dx[BODY_X + axis] = 1.0;
        }
        dx
    })
}

/// Legs change sides; abduction, y, roll and yaw, and the force and moments that go with them, change sign.
fn mirrored(vector: &DVector<f64>) -> DVector<f64> {
    let mut image = vector.clone();
    for leg in Leg::ALL {
        let other = Leg::ALL[leg.index() ^ 1];
        for joint in 0..3 {
            let sign = if joint == 0 { -1.0 } else { 1.0 };
            image[3 * leg.index() + joint] = sign * vector[3 * other.index() + joint];
        }
    }
    for row in [BODY_X + 1, BODY_X + 3, BODY_X + 5] {
        image[row] = -vector[row];
    }
    image
}

/// The combination of latent coordinates that consists of one body coordinate and joints alone. Of several, it is the
/// one that inputs accelerate least in flight. With a flight phase also returns its acceleration there, and the gain of
/// inputs on it as a share of their gain on the coordinates.
fn momentum(
    model: &ReducedModel,
    rest: &DVector<f64>,
    row: usize,
) -> Result<Option<(DVector<f64>, Option<[f64; 2]>)>, ModelError> {
    let body_dim = STATE_DIM - JOINT_DIM;
    let encode = model.tangent(rest)?.encode;
    let body = encode.columns(JOINT_DIM, body_dim).transpose();
    let mut one = DVector::zeros(body_dim);
    one[row - JOINT_DIM] = 1.0;
    let Ok(inverse) = body.clone().pseudo_inverse(1e-9 * body.amax()) else {
        return Ok(None);
    };
    let particular = &inverse * &one;
    if (&body * &particular - one).amax() > PURE {
        return Ok(None);
    }
    let Some(phase) = model.phase_for([false; 4]) else {
        return Ok(Some((particular, None)));
    };
    let d = model.latent_dim();
    let projector = SymmetricEigen::new(DMatrix::identity(d, d) - &inverse * &body);
    let free: Vec<usize> = (0..d).filter(|&i| projector.eigenvalues[i] > 0.5).collect();
    let others = projector.eigenvectors.select_columns(&free);
    let probe = Probe::new(model, phase, rest);
    let ddz = probe.ddz_at_rest(&probe.input)?;
    let change = probe.gain(&ddz)?.transpose();
    let inverse = || (&change * &others).pseudo_inverse(1e-9 * change.amax());
    let combination = match (!free.is_empty()).then(inverse) {
        Some(Ok(inverse)) => &particular - &others * (inverse * (&change * &particular)),
        Some(Err(_)) | None => particular,
    };
    let moved = (&change * &combination).norm() / change.norm().max(f64::MIN_POSITIVE);
    let in_flight = [combination.dot(&ddz), moved];
    Ok(Some((combination, Some(in_flight))))
}

/// The change of a combination's acceleration over a load of vertical forces of the feet; none without four feet down.
fn response(
    model: &ReducedModel,
    rest: &DVector<f64>,
    combination: &DVector<f64>,
    load: usize,
) -> Result<Option<f64>, ModelError> {
    let feet: ContactFlags = [true; 4];
    let Some(phase) = model.phase_for(feet) else {
        return Ok(None);
    };
    let (robot, rule) = (model.robot()?, model.input_rule()?);
    let x: [f64; STATE_DIM] = std::array::from_fn(|i| rest[i]);
    let joints = std::array::from_fn(|joint| x[joint]);
    let mut torques = [0.0; JOINT_DIM];
    for leg in Leg::ALL {
        // Front feet that push up pitch the body back.
        let up = if load == LIFT || !leg.is_front() {
            0.25
        } else {
            -0.25
        };
        let jacobian = robot.geometry(leg).foot_jacobian(&leg.of_joints(&joints));
        let torque = -jacobian.transpose() * SVector::<f64, 3>::new(0.0, 0.0, up);
        torques[3 * leg.index()..][..3].copy_from_slice(torque.as_slice());
    }
    let Ok(wrench) = rule.wrench(&x, &torques, feet) else {
        return Ok(None);
    };
    let mut u = DVector::zeros(STATE_DIM);
    u.rows_mut(0, JOINT_DIM).copy_from_slice(&torques);
    (u.rows_mut(JOINT_DIM, STATE_DIM - JOINT_DIM)).copy_from(&wrench);
    // In the body's frame arms are those of the hips.
    let about_origin = InputRule::new(robot, None, WrenchFrame::World);
    let Ok(loads) = about_origin.wrench(&x, &torques, feet) else {
        return Ok(None);
    };
    let probe = Probe::new(model, phase, rest);
    let pushed = probe.ddz_at_rest(&(&probe.input + &u))?;
    let change = combination.dot(&(pushed - probe.ddz_at_rest(&probe.input)?));
    Ok(Some(change / loads[load]).filter(|change| change.is_finite()))
}
