//! The list of symbols, and the units of equations in physical units as a sentence.

use std::ops::Range;

use super::*;
use crate::equations::LatentUnits;
use crate::model::{Activation, CoordinateNames, ScaleFactors, StateMap};
use crate::robot::{BODY_DIM, BODY_NAMES, JOINT_DIM, JOINT_NAMES, LEG_JOINT_DIM, Leg, STATE_DIM};
use crate::typeset::robot::coordinate_symbols;

const STRONGEST: usize = 3; // of an encoder row's weights are named
const NEGLIGIBLE: f64 = 0.1; // share of the row's largest weight below which none is named

#[derive(Template)]
#[template(
    path = "latex/nomenclature.askama",
    config = "templates/askama.toml",
    syntax = "latex"
)]
struct Nomenclature {
    header: String,
    positions: Vec<(String, String)>, // symbol and meaning
    /// All velocities and all inputs, by unit where they have units.
    velocities: String,
    inputs: String,
    is_physical: bool,
    /// The map of velocities: the weights of an affine encoder, the Jacobian of another.
    map: Option<&'static str>,
    layers: Option<String>,
    factors: Vec<(char, String)>,
    lift: Option<String>,
    /// Whether state and input are those of a quadruped, with names that are explained.
    is_quadruped: bool,
    coordinates: Option<String>,
}

/// The file `NAME-nomenclature.tex`.
pub(super) fn file(
    system: &Equations<'_>,
    header: String,
    options: &PrintOptions,
) -> Result<EmittedFile, TypesetError> {
    let (model, units) = (&*system.model, system.latent_units());
    let (dim, numbers) = (model.latent_dim(), options.numbers);
    let all = |of: fn(usize) -> LatentVariable| {
        let variables: Vec<LatentVariable> = (0..dim).map(of).collect();
        match units {
            Some(units) => by_unit(&variables, units, &options.symbols).join("; "),
            None => several(&variables, &options.symbols),
        }
    };
    let words = system.latent_words();
    let position = |index: usize| {
        let variable = LatentVariable::Z(index);
        let words = words.get(index).map(|words| match units {
            Some(_) => words.quantity.clone(),
            None => words.to_string(),
        });
        let quantity = words.map_or(format!("latent coordinate {}", index + 1), |words| {
            tex_text(&words)
        });
        let unit = units.map_or(String::new(), |units| {
            format!(", {}", in_unit(units.of(variable)))
        });
        let weights = largest_weights(model, index, numbers).unwrap_or_default();
        let symbol = tex_symbol(&options.symbols.symbol(variable));
        (format!("${symbol}$"), quantity + &unit + &weights)
    };
    let quadruped = CoordinateNames::of_robot();
    let nomenclature = Nomenclature {
        header,
        positions: (0..dim).map(position).collect(),
        velocities: all(LatentVariable::Dz),
        inputs: all(LatentVariable::U),
        is_physical: units.is_some(),
        map: match (model.encoder(), model.encoder_map()) {
            (Ok(_), _) => Some(r"\mathbf{W}_e"),
            (Err(_), Ok(_)) => Some(r"\mathbf{J}"),
            (Err(_), Err(_)) => None,
        },
        layers: (model
            .encoder_map()
            .ok()
            .filter(|_| model.encoder().is_err()))
        .map(layers),
        factors: scale_factors(model, numbers),
        lift: units.and_then(|units| lift(system, units, &options.symbols, numbers)),
        is_quadruped: [model.state(), model.input()] == quadruped.each_ref().map(Some),
        coordinates: model.state().map(coordinates),
    };
    let path = format!("{}-nomenclature.tex", model.identifier());
    Ok(EmittedFile::new(path, rendered(&nomenclature)?))
}

/// `$z_1$, $z_2$`; of more than three that follow each other the first and the last.
fn several(variables: &[LatentVariable], symbols: &SymbolTable) -> String {
    let symbol =
        |variable: &LatentVariable| format!("${}$", tex_symbol(&symbols.symbol(*variable)));
    let place = |variable: &LatentVariable| match *variable {
        LatentVariable::Z(place) | LatentVariable::Dz(place) | LatentVariable::U(place) => place,
    };
    match variables {
        [first, .., last]
            if variables.len() > 3 && place(last) - place(first) + 1 == variables.len() =>
        {
            format!(r"{}, \dots, {}", symbol(first), symbol(last))
        }
        _ => variables.iter().map(symbol).collect::<Vec<_>>().join(", "),
    }
}

/// `$z_1$, $z_2$ in $\mathrm{m}$` for each unit.
fn by_unit(
    variables: &[LatentVariable],
    units: &LatentUnits,
    symbols: &SymbolTable,
) -> Vec<String> {
    let mut groups: Vec<(Unit, Vec<LatentVariable>)> = Vec::new();
    for &variable in variables {
        let unit = units.of(variable);
        match groups.iter_mut().find(|(known, _)| *known == unit) {
            Some((_, group)) => group.push(variable),
            None => groups.push((unit, vec![variable])),
        }
    }
    let text = |(unit, group): &(Unit, Vec<LatentVariable>)| {
        format!("{} {}", several(group, symbols), in_unit(*unit))
    };
    groups.iter().map(text).collect()
}

fn in_unit(unit: Unit) -> String {
    match unit == Unit::default() {
        true => "without unit".to_owned(),
        false => format!("in ${}$", tex_unit(unit)),
    }
}

/// The units of coordinates and inputs in equations; `None` where they are scaled.
pub(super) fn units_sentence(system: &Equations<'_>, symbols: &SymbolTable) -> Option<String> {
    let units = system.latent_units()?;
    let of = |of: fn(usize) -> LatentVariable| {
        let variables: Vec<LatentVariable> = (0..system.latent_dim()).map(of).collect();
        by_unit(&variables, units, symbols)
    };
    let all = [of(LatentVariable::Z), of(LatentVariable::U)].concat();
    Some(format!(
        r"Units: {}; time in $\mathrm{{s}}$.",
        all.join("; ")
    ))
}

/// The robot coordinates of which a latent coordinate mostly consists, in words and with weights of SI values.
fn largest_weights(model: &ReducedModel, row: usize, numbers: NumberStyle) -> Option<String> {
    let (encoder, state) = (model.encoder().ok()?, model.state()?);
    let weights = encoder.weights().row(row).transpose();
    let weights = match model.state_factors() {
        Ok(factors) => weights.component_mul(&factors),
        Err(_) => weights,
    };
    let symbols = coordinate_symbols(&state.names);
    let mut weights: Vec<(usize, f64)> = weights.iter().copied().enumerate().collect();
    weights.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    let largest = weights.first().map_or(0.0, |(_, weight)| weight.abs());
    let strongest: Vec<String> = (weights.iter().take(STRONGEST))
        .filter(|(_, weight)| weight.abs() > NEGLIGIBLE * largest)
        .map(|&(place, weight)| {
            let weight = tex_number(&Decimal::rounded(weight, Rounding::Significant(2)), numbers);
            let (words, symbol) = (
                coordinate_words(&state.names[place]),
                tex_symbol(&symbols[place]),
            );
            format!(r"{words} (${weight}\,{symbol}$)")
        })
        .collect();
    let noun = if strongest.len() == 1 {
        "weight"
    } else {
        "weights"
    };
    Some(format!("; largest {noun}: {}", strongest.join(", ")))
}

/// `knee angle, front right` for `fr.kn`; another name as it is.
fn coordinate_words(name: &str) -> String {
    let joint = |place: usize| {
        let leg = Leg::ALL[place / LEG_JOINT_DIM];
        format!("{}, {}", JOINTS[place % LEG_JOINT_DIM], leg.words())
    };
    let names = JOINT_NAMES.iter().chain(&BODY_NAMES);
    match names.copied().position(|known| known == name) {
        Some(place) if place < JOINT_DIM => joint(place),
        Some(place) => BODY[place - JOINT_DIM].to_owned(),
        None => tex_text(name),
    }
}

const JOINTS: [&str; LEG_JOINT_DIM] = ["hip abduction", "hip flexion", "knee angle"];
const BODY: [&str; BODY_DIM] = [
    "forward position of the body",
    "position of the body to the left",
    "height of the body",
    "roll of the body",
    "pitch of the body",
    "yaw of the body",
];

/// Names of robot coordinates that are not those of a quadruped, below their symbols.
fn coordinates(state: &CoordinateNames) -> String {
    let symbols = coordinate_symbols(&state.names);
    let named = symbols.iter().zip(&state.names);
    let named = named.map(|(symbol, name)| format!("${}$ {}", tex_symbol(symbol), tex_text(name)));
    named.collect::<Vec<_>>().join(", ")
}

/// How the lift follows from the printed encoder, as a formula and its constants.
fn lift(
    system: &Equations<'_>,
    units: &LatentUnits,
    symbols: &SymbolTable,
    numbers: NumberStyle,
) -> Option<String> {
    let scaled = &system.in_scaled_units().model;
    let (s_x, s_u) = (scaled.state_factors().ok()?, scaled.input_factors().ok()?);
    let constants = s_x.component_mul(&s_u) / (s_x[0] * s_u[0]);
    let input = scaled.input()?;
    let of_group = |(words, range): &(&str, Range<usize>)| {
        let own = constants.rows(range.start, range.len());
        let is_one = own
            .iter()
            .all(|constant| (constant / own[0] - 1.0).abs() < SAME);
        let number = Decimal::exact(rounded(own[0], 6));
        is_one.then(|| format!("${}$ for {words}", tex_number(&number, numbers)))
    };
    let is_quadruped = *input == CoordinateNames::of_robot()[1];
    let groups: Option<Vec<String>> = INPUTS.iter().map(of_group).collect();
    let values = match groups.filter(|_| is_quadruped) {
        Some(groups) => groups.join(", "),
        None => "the product of the scale factors of coordinate and input".to_owned(),
    };
    // Columns that no input of their unit normalises.
    let own_units: Vec<Option<Unit>> = (input.units.iter())
        .map(|unit| Unit::from_name(unit))
        .collect();
    let is_by_squares = |latent: &usize| {
        let shares = units.lift.column(*latent);
        let own = (own_units.iter().zip(&shares))
            .filter(|(unit, _)| **unit == Some(units.input[*latent]));
        (own.map(|(_, share)| share.abs()).sum::<f64>() - 1.0).abs() > SAME
    };
    let by_squares = (0..units.input.len()).filter(is_by_squares);
    let by_squares: Vec<LatentVariable> = by_squares.map(LatentVariable::U).collect();
    let squares = match by_squares.as_slice() {
        [] => String::new(),
        some => format!(r", for {} $\sum_j L_{{ji}}^2 = 1$", several(some, symbols)),
    };
    Some(format!(
        r"$s_j$: {values}; $c_i > 0$ such that $\sum_j |L_{{ji}}| = 1$ over the inputs in the unit of input $i${squares}"
    ))
}

const SAME: f64 = 1e-9; // relative difference
const INPUTS: [(&str, Range<usize>); 3] = [
    ("joint torques", 0..JOINT_DIM),
    ("forces", JOINT_DIM..JOINT_DIM + 3),
    ("moments", JOINT_DIM + 3..STATE_DIM),
];

/// A nonlinear encoder by the widths of its layers; its weights stay in the model file.
fn layers(encoder: &StateMap) -> String {
    let widths = encoder.layers().iter().map(|layer| {
        let width = layer.map.output_dim();
        match layer.activation {
            Activation::Linear => width.to_string(),
            activation => format!("{width} ({activation})"),
        }
    });
    let (inputs, widths) = (encoder.input_dim(), widths.collect::<Vec<_>>().join(", "));
    format!("inputs {inputs}, layers {widths}")
}

fn scale_factors(model: &ReducedModel, numbers: NumberStyle) -> Vec<(char, String)> {
    let value = |factors: &ScaleFactors| match factors {
        ScaleFactors::Uniform(factor) => {
            format!(
                "${}$ for all",
                tex_number(&Decimal::exact(*factor), numbers)
            )
        }
        ScaleFactors::PerCoordinate(_) => "one per coordinate".to_owned(),
    };
    let scaling = model.scaling().into_iter();
    scaling
        .flat_map(|of| [('x', value(&of.state)), ('u', value(&of.input))])
        .collect()
}
