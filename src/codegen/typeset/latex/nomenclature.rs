//! What each symbol of the equations means.

use crate::equations::{Equations, LatentUnits};
use crate::model::{Activation, LatentVariable, ReducedModel, ScaleFactors, StateMap};
use crate::typeset::{Decimal, NumberStyle, Rounding, SymbolTable};

use super::escape::tex_text;
use super::math::{tex_number, tex_symbol, tex_unit};

/// How many of an encoder row's weights are named.
const STRONGEST: usize = 3;
/// Weights below this share of the row's largest are not named.
const NEGLIGIBLE: f64 = 0.1;
/// One line of the list of symbols as LaTeX: the symbol, in dollars, and what it is.
pub(super) type Entry = (String, String);

fn entry(symbol: impl Into<String>, meaning: impl Into<String>) -> Entry {
    (symbol.into(), meaning.into())
}

const ROBOT_STATE: &str = r"$\mathbf{x}$, $\mathbf{u}$";
const ENCODER: &str = r"$\mathbf{W}_e$, $\mathbf{b}_e$";

pub(super) fn entries(
    system: &Equations<'_>,
    symbols: &SymbolTable,
    numbers: NumberStyle,
) -> Vec<Entry> {
    let model = system.model();
    if let Some(units) = system.latent_units() {
        return physical_entries(model, units, symbols, numbers);
    }
    let dim = model.latent_dim();
    let position = |index| {
        let symbol = symbol(symbols, LatentVariable::Z(index));
        entry(symbol, coordinate(model, index, numbers))
    };
    let mut list: Vec<Entry> = (0..dim).map(position).collect();
    // the map of velocities: the weights of an affine encoder, the Jacobian of another
    let map = match (model.encoder(), model.encoder_map()) {
        (Ok(_), _) => Some(r"\mathbf{W}_e"),
        (Err(_), Ok(_)) => Some(r"\mathbf{J}"),
        (Err(_), Err(_)) => None,
    };
    let [mut velocities, mut inputs] = ["latent velocities", "latent inputs"].map(str::to_owned);
    if let Some(map) = map {
        velocities +=
            &format!(r", $\dot{{\mathbf{{z}}}} = {map} (\mathbf{{s}}_x \dot{{\mathbf{{x}}}})$");
        inputs += &format!(
            r", $\mathbf{{u}}_{{\mathrm{{lat}}}} = ({map}^{{\mathsf{{T}}}})^{{+}} (\mathbf{{s}}_u \mathbf{{u}})$, lifted by $\mathbf{{s}}_u \mathbf{{u}} = {map}^{{\mathsf{{T}}}} \mathbf{{u}}_{{\mathrm{{lat}}}}$"
        );
    }
    list.push(entry(range(symbols, LatentVariable::Dz, dim), velocities));
    list.push(entry(range(symbols, LatentVariable::U, dim), inputs));
    if let Ok(encoder) = model.encoder_map() {
        let state = "robot state and generalised input in SI units";
        list.push(entry(ROBOT_STATE, state));
        list.push(match model.encoder() {
            Ok(_) => entry(
                ENCODER,
                r"encoder, $\mathbf{z} = \mathbf{W}_e (\mathbf{s}_x \mathbf{x}) + \mathbf{b}_e$",
            ),
            Err(_) => layers(encoder),
        });
        list.extend(scale_factors(model, numbers));
    }
    list
}

fn physical_entries(
    model: &ReducedModel,
    units: &LatentUnits,
    symbols: &SymbolTable,
    numbers: NumberStyle,
) -> Vec<Entry> {
    let indices = || 0..model.latent_dim();
    let positions = indices().map(|index| {
        let unit = tex_unit(units.position[index]);
        let meaning = format!("${unit}$; {}", coordinate(model, index, numbers));
        entry(symbol(symbols, LatentVariable::Z(index)), meaning)
    });
    let inputs = indices().map(|index| {
        let (unit, number) = (tex_unit(units.input[index]), index + 1);
        let meaning =
            format!("${unit}$; the input that does work along latent coordinate {number}");
        entry(symbol(symbols, LatentVariable::U(index)), meaning)
    });
    let velocities = entry(
        range(symbols, LatentVariable::Dz, model.latent_dim()),
        r"their derivatives by time, $\dot{\mathbf{z}} = \mathbf{W}_e \dot{\mathbf{x}}$, per second",
    );
    let robot = [
        entry(
            ROBOT_STATE,
            r"robot state and generalised input in SI units; $\mathbf{u} = \mathbf{L}\,\mathbf{u}_{\mathrm{lat}}$ with the constant matrix $\mathbf{L}$ of the generated code",
        ),
        entry(
            ENCODER,
            r"encoder in these units, $\mathbf{z} = \mathbf{W}_e \mathbf{x} + \mathbf{b}_e$",
        ),
    ];
    let latent = positions.chain([velocities]).chain(inputs);
    latent.chain(robot).collect()
}

fn symbol(symbols: &SymbolTable, variable: LatentVariable) -> String {
    format!("${}$", tex_symbol(&symbols.symbol(variable)))
}

/// `$z_1, \dots, z_6$`, or all of up to three.
fn range(symbols: &SymbolTable, of: fn(usize) -> LatentVariable, dim: usize) -> String {
    let show = |index| symbol(symbols, of(index));
    match dim {
        ..=3 => (0..dim).map(show).collect::<Vec<_>>().join(", "),
        _ => format!(r"{}, \dots, {}", show(0), show(dim - 1)),
    }
}

/// A latent coordinate and the robot coordinates that it mostly consists of.
fn coordinate(model: &ReducedModel, row: usize, numbers: NumberStyle) -> String {
    let (Ok(encoder), Some(state)) = (model.encoder(), model.state()) else {
        return format!("latent coordinate {}", row + 1);
    };
    let weights = encoder.weights().row(row);
    let weights = state.names.iter().zip(weights.iter().copied());
    let mut weights: Vec<(&String, f64)> = weights.collect();
    weights.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    let largest = weights.first().map_or(0.0, |(_, weight)| weight.abs());
    let strongest: Vec<String> = (weights.iter().take(STRONGEST))
        .filter(|(_, weight)| weight.abs() > NEGLIGIBLE * largest)
        .map(|(name, weight)| {
            let weight = Decimal::rounded(*weight, Rounding::default());
            let (name, weight) = (tex_text(name), tex_number(&weight, numbers));
            format!(r"\texttt{{{name}}} (${weight}$)")
        })
        .collect();
    let (number, strongest) = (row + 1, strongest.join(", "));
    format!("latent coordinate {number}; largest weights: {strongest}")
}

/// A nonlinear encoder by the widths of its layers; its weights stay in the model file.
fn layers(encoder: &StateMap) -> Entry {
    let widths = encoder.layers().iter().map(|layer| {
        let width = layer.map.output_dim();
        match layer.activation {
            Activation::Linear => width.to_string(),
            activation => format!("{width} ({activation})"),
        }
    });
    let (inputs, widths) = (encoder.input_dim(), widths.collect::<Vec<_>>().join(", "));
    entry(
        r"$\mathbf{E}$, $\mathbf{J}$",
        format!(
            r"nonlinear encoder, $\mathbf{{z}} = \mathbf{{E}}(\mathbf{{s}}_x \mathbf{{x}})$, and its Jacobian at $\mathbf{{s}}_x \mathbf{{x}}$; inputs {inputs}, layers {widths}"
        ),
    )
}

fn scale_factors(model: &ReducedModel, numbers: NumberStyle) -> Vec<Entry> {
    let Ok(scaling) = model.scaling() else {
        return Vec::new();
    };
    let factors = [("x", &scaling.state), ("u", &scaling.input)];
    let line = |(symbol, factors): (&str, &ScaleFactors)| {
        let value = match factors {
            ScaleFactors::Uniform(factor) => {
                let factor = tex_number(&Decimal::exact(*factor), numbers);
                format!("${factor}$ for all")
            }
            ScaleFactors::PerCoordinate(_) => "one per coordinate".to_owned(),
        };
        entry(
            format!(r"$\mathbf{{s}}_{symbol}$"),
            format!(r"scale factors of $\mathbf{{{symbol}}}$: {value}"),
        )
    };
    factors.into_iter().map(line).collect()
}
