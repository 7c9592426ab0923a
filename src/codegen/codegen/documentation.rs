//! Words of the generated documentation: equations, arrays and units of each function.

use super::*;
use crate::robot::{LEAST_HEIGHT, LEAST_SPAN, WrenchFrame};

const MOST_TERMS: usize = 40;

const WORLD_AXES: &str = "Axes are the world's; the arm p_k of a moment is the foot from the body's origin. The three \
     moments are the generalised forces of roll, pitch and yaw: they do work on the rates of these angles";

/// A list of the latent coordinates behind a blank line; empty where the model does not determine them.
pub(super) fn of_coordinates(system: &Equations<'_>) -> Vec<String> {
    let mut lines = Vec::new();
    for (number, words) in (1..).zip(system.latent_words()) {
        if number == 1 {
            lines.extend(["", "Latent coordinates:", ""].map(str::to_owned));
        }
        lines.push(format!("- z{number}: {words}"));
    }
    lines
}

pub(super) fn of_inputs(model: &ReducedModel) -> Result<[Vec<String>; 3], LowerError> {
    let robot = model.robot()?.name;
    let axes = match model.wrench_frame() {
        WrenchFrame::Body => {
            "Axes are parallel to the body's: x forward, y left, z up. The arm p_k of a moment is the foot in \
             its own hip frame, as in the data that models are learned from."
                .to_owned()
        }
        WrenchFrame::World => format!("{WORLD_AXES}."),
        WrenchFrame::Ground => format!(
            "{WORLD_AXES}. A foot whose force would point down adds nothing: the ground does not pull."
        ),
    };
    let (net, losses) = match model.actuators() {
        Some(_) => (
            "the torques at the links, tau less the joints' viscous and dry friction b dq + c tanh(dq / \
             0.05 rad/s)",
            "tau = net + b dq + c tanh(dq / 0.05 rad/s) + I ddq with the joints' friction and the inertia of \
             the motors.",
        ),
        None => (
            "the motor torques unchanged: the model has no losses of the joints, dx is not used",
            "tau = net: the model has no losses of the joints, dx and ddx are not used.",
        ),
    };
    let is_ground = model.wrench_frame() == WrenchFrame::Ground && model.actuators().is_some();
    let has_legs = model.input_rule().is_ok_and(|rule| rule.legs().is_some());
    let (inertia, in_flight) = if has_legs {
        (
            "With a foot on the ground, subtract the motors' inertia times acceleration and leg_torque from \
             tau before; in flight do not.",
            " In flight give zeros as ddx: the motors' inertia is part of net. With a foot on the ground add \
             leg_torque.",
        )
    } else if is_ground {
        (
            "With a foot on the ground, subtract the motors' inertia times acceleration from tau before; in \
             flight do not.",
            " In flight give zeros as ddx: the motors' inertia is part of net.",
        )
    } else {
        (
            "The torque of the motors' inertia is not subtracted: that needs accelerations.",
            "",
        )
    };
    let input = [
        &format!(
            "Generalised inputs of the {robot}: u = [net; sum of F_k; sum of p_k x F_k] over the feet on \
             the ground, F_k = -J_k^-T net_k the force on the body (equations 4 to 7, 22, 23)."
        ),
        &format!(
            "x, dx: robot coordinates and their velocities in SI units. tau: torques of the motors (N m). \
             feet: 1 on the ground, 0 in the air, order fr, fl, rr, rl. u: net, force (N) and moment (N m) \
             on the body. net: {net}. {inertia}"
        ),
        &axes,
        &format!(
            "Near a singularity of a leg on the ground its force is damped: a knee that spans less than \
             {LEAST_SPAN} of thigh times calf, a foot nearer to its hip's height than {LEAST_HEIGHT} of the \
             leg."
        ),
    ];
    let legs = [
        format!(
            "Torques that carry and move the links of each leg of the {robot} with its foot on the ground. \
             Subtract them from tau before generalised_input, add them to commands."
        ),
        "x, dx, ddx: robot coordinates, their velocities and accelerations in SI units. feet: 1 on the \
         ground, 0 in the air, order fr, fl, rr, rl. own: torques (N m), zero for legs in the air."
            .to_owned(),
    ];
    Ok([
        input.map(String::from).into(),
        of_torques(model, losses, in_flight),
        legs.into(),
    ])
}

fn of_torques(model: &ReducedModel, losses: &str, in_flight: &str) -> Vec<String> {
    let robot = model.robot().map_or("robot", |robot| robot.name);
    let torque = [
        format!("Torques of the {robot}'s motors behind torques at the links: {losses}"),
        format!(
            "dx, ddx: velocities and accelerations of the robot coordinates in SI units, of which the joints \
             count (0 to 11).{in_flight} net: the first 12 of u (N m). tau: torques of the motors (N m); \
             limits are the caller's."
        ),
    ];
    torque.into()
}

/// For each map: its equation with an affine and with a nonlinear encoder or decoder, and its arrays. The point of the
/// Jacobian, units and names of the elements are placeholders in braces.
const MAPS: [[&str; 3]; 6] = [
    [
        "Latent coordinates: z = W_e (s_x x) + b_e.",
        "Latent coordinates: z = E(s_x x) with the nonlinear encoder E.",
        "x: {n}. z: latent coordinates {z}.{of_x}",
    ],
    [
        "Latent velocities: dz = W_e (s_x dx), without the bias.",
        "Latent velocities: dz = J (s_x dx) with J, the encoder's Jacobian at s_x x.",
        "{at_x}dx: velocities of the {n}. dz: latent velocities {dz}.",
    ],
    [
        "Robot coordinates: x = (W_d z + b_d) / s_x.",
        "Robot coordinates: x = D(z) / s_x with the nonlinear decoder D.",
        "z: latent coordinates {z}. x: {n}.{of_x}",
    ],
    [
        "Robot velocities: dx = (W_d dz) / s_x, without the bias.",
        "Robot velocities: dx = (J dz) / s_x with J, the decoder's Jacobian at z.",
        "{at_z}dz: latent velocities {dz}. dx: velocities of the {n}.",
    ],
    [
        "Latent inputs: u_lat = pinv(W_e^T) (s_u u).",
        "Latent inputs: u_lat = pinv(J^T) (s_u u) with J, the encoder's Jacobian at s_x x, \
         by the normal equations; not finite where J has not full row rank.",
        "{at_x}u: generalised inputs in {unit}. u_lat: latent inputs {u_lat}.{of_u}",
    ],
    [
        "Generalised inputs: u = (W_e^T u_lat) / s_u.",
        "Generalised inputs: u = (J^T u_lat) / s_u with J, the encoder's Jacobian at s_x x.",
        "{at_x}u_lat: latent inputs {u_lat}. u: generalised inputs in {unit}.{of_u}",
    ],
];

pub(super) fn of_maps(
    model: &ReducedModel,
    units: Units,
    latent: Option<&LatentUnits>,
) -> [Vec<String>; 6] {
    let (state, input) = match units {
        Units::Si => (model.state(), model.input()),
        // Their units are those of SI values.
        Units::Scaled => (None, None),
    };
    let mut equation_words = Vec::new();
    if latent.is_some() || units == Units::Scaled {
        equation_words.extend([("(s_x x)", "x"), ("(s_x dx)", "dx"), ("(s_u u)", "u")]);
        equation_words.extend([("s_x x", "x"), (" / s_x", ""), (" / s_u", "")]);
    }
    if latent.is_some() {
        equation_words.extend([("pinv(W_e^T) u", "P u"), ("W_e^T u_lat", "L u_lat")]);
    }
    let unit = units.of_robot();
    let of = |array, units: &[Unit]| {
        let units = units.iter().enumerate();
        let units = units.map(|(k, unit)| format!("{array}[{k}] {unit}"));
        format!("({})", units.collect::<Vec<_>>().join(", "))
    };
    let [z, dz, u_lat] = match latent {
        None => ["(scaled)"; 3].map(str::to_owned),
        Some(latent) => [
            of("z", &latent.position),
            "(in the units of z per second)".to_owned(),
            of("u_lat", &latent.input),
        ],
    };
    let maps = [model.encoder_map(), model.decoder_map()];
    let [encoder, decoder] = maps.map(|map| map.is_ok_and(|map| map.as_affine().is_none()));
    let at = |is_nonlinear, text: &str| if is_nonlinear { text } else { "" }.to_owned();
    let at_x = "x: robot coordinates at which the Jacobian is evaluated, SI units. ";
    let at_z = "z: latent coordinates at which the Jacobian is evaluated (scaled). ";
    let text_words = [
        ("{at_x}", at(encoder, at_x)),
        ("{at_z}", at(decoder, at_z)),
        ("{n}", format!("robot coordinates in {unit}")),
        ("{unit}", unit.to_owned()),
        ("{z}", z),
        ("{dz}", dz),
        ("{u_lat}", u_lat),
        ("{of_x}", elements("x", state)),
        ("{of_u}", elements("u", input)),
    ];
    std::array::from_fn(|k| {
        let [affine, nonlinear, text] = MAPS[k];
        let is_nonlinear = if matches!(k, 2 | 3) { decoder } else { encoder };
        let equation = if is_nonlinear { nonlinear } else { affine }.to_owned();
        let equation_words = equation_words.iter();
        vec![
            equation_words.fold(equation, |text, (word, new)| text.replace(word, new)),
            (text_words.iter()).fold(text.to_owned(), |text, (word, new)| text.replace(word, new)),
        ]
    })
}

/// " `x[0]` fr.hx (rad), ..." if the model names its coordinates.
fn elements(array: &str, signals: Option<&CoordinateNames>) -> String {
    signals.map_or(String::new(), |signals| {
        let pairs = signals.names.iter().zip(&signals.units).enumerate();
        let pairs = pairs.map(|(k, (name, unit))| format!("{array}[{k}] {name} ({unit})"));
        format!(" {}.", pairs.collect::<Vec<_>>().join(", "))
    })
}

/// The equations of a phase, one line each; long ones only as a count of terms.
pub(super) fn equations(system: &Equations<'_>, phase: usize) -> Result<Vec<String>, LowerError> {
    let mut lines = Vec::new();
    let of_phase = system.phase(phase)?;
    for row in 0..system.latent_dim() {
        let terms: Vec<_> = of_phase.summands(system, row).collect();
        let mut right = String::new();
        for (coefficient, term) in terms.iter().take(MOST_TERMS) {
            let sign = match (right.is_empty(), *coefficient < 0.0) {
                (true, false) => "",
                (true, true) => "-",
                (false, false) => " + ",
                (false, true) => " - ",
            };
            right.push_str(sign);
            right.push_str(&summand_words(coefficient.abs(), &term.text));
        }
        let right = match terms.len() {
            0 => "0".to_owned(),
            1..=MOST_TERMS => right,
            count => format!("a sum of {count} terms"),
        };
        lines.push(format!("ddz{} = {right}", row + 1));
        let units = system.latent_units();
        if let Some(units) = units.filter(|_| (1..=MOST_TERMS).contains(&terms.len())) {
            let unit = |term| units.acceleration(row) / units.of_term(&system.pool, term);
            let each = terms.iter();
            let each = each.map(|(_, term)| format!("{} {}", term.text, unit(term.expr)));
            let each = each.collect::<Vec<_>>().join(", ");
            lines.push(format!(
                "Units of the coefficients of ddz{}: {each}.",
                row + 1
            ));
        }
    }
    Ok(lines)
}
