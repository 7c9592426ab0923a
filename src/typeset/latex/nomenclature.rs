//! What each symbol of the equations means.

use crate::equations::{Equations, LatentUnits};
use crate::model::{Activation, ReducedModel, ScaleFactors, StateMap};
use crate::typeset::{Decimal, NumberStyle, Quantity, Rounding, SymbolTable, Variable};

use super::escape::TexText;
use super::math::{TexNumber, TexSymbol, TexUnit};

/// How many of an encoder row's weights are named.
const STRONGEST: usize = 3;
/// Weights below this share of the row's largest are not named.
const NEGLIGIBLE: f64 = 0.1;
/// One line of the list of symbols, both parts as LaTeX.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Entry {
    /// The symbol, in dollars.
    pub symbol: String,
    /// What it is.
    pub meaning: String,
}

/// The list of symbols of the equations.
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
    let has_layers = model.encoder_map().is_ok();
    let mut list: Vec<Entry> = (1..=dim)
        .map(|index| Entry {
            symbol: symbol(symbols, Quantity::Position, index),
            meaning: coordinate(model, index - 1, numbers),
        })
        .collect();
    list.push(Entry {
        symbol: range(symbols, Quantity::Velocity, dim),
        meaning: match model.encoder() {
            Ok(_) => r"latent velocities, $\dot{\mathbf{z}} = \mathbf{W}_e (\mathbf{s}_x \dot{\mathbf{x}})$".to_owned(),
            Err(_) if has_layers => r"latent velocities, $\dot{\mathbf{z}} = \mathbf{J} (\mathbf{s}_x \dot{\mathbf{x}})$".to_owned(),
            Err(_) => "latent velocities".to_owned(),
        },
    });
    list.push(Entry {
        symbol: range(symbols, Quantity::Input, dim),
        meaning: match model.encoder() {
            Ok(_) => r"latent inputs, $\mathbf{u}_{\mathrm{lat}} = (\mathbf{W}_e^{\mathsf{T}})^{+} (\mathbf{s}_u \mathbf{u})$, lifted by $\mathbf{s}_u \mathbf{u} = \mathbf{W}_e^{\mathsf{T}} \mathbf{u}_{\mathrm{lat}}$".to_owned(),
            Err(_) if has_layers => r"latent inputs, $\mathbf{u}_{\mathrm{lat}} = (\mathbf{J}^{\mathsf{T}})^{+} (\mathbf{s}_u \mathbf{u})$, lifted by $\mathbf{s}_u \mathbf{u} = \mathbf{J}^{\mathsf{T}} \mathbf{u}_{\mathrm{lat}}$".to_owned(),
            Err(_) => "latent inputs".to_owned(),
        },
    });
    if model.encoder().is_ok() {
        list.extend(robot_entries(model, numbers));
    } else if let Ok(encoder) = model.encoder_map() {
        list.push(robot_state());
        list.push(layers(encoder));
        list.extend(scale_factors(model, numbers));
    }
    list
}

/// The list of symbols of equations in physical units.
fn physical_entries(
    model: &ReducedModel,
    units: &LatentUnits,
    symbols: &SymbolTable,
    numbers: NumberStyle,
) -> Vec<Entry> {
    let indices = || 1..=model.latent_dim();
    let mut list: Vec<Entry> = indices()
        .map(|index| Entry {
            symbol: symbol(symbols, Quantity::Position, index),
            meaning: format!(
                "${}$; {}",
                TexUnit(units.position[index - 1]),
                coordinate(model, index - 1, numbers)
            ),
        })
        .collect();
    list.push(Entry {
        symbol: range(symbols, Quantity::Velocity, model.latent_dim()),
        meaning: r"their derivatives by time, $\dot{\mathbf{z}} = \mathbf{W}_e \dot{\mathbf{x}}$, per second".to_owned(),
    });
    list.extend(indices().map(|index| Entry {
        symbol: symbol(symbols, Quantity::Input, index),
        meaning: format!(
            "${}$; the input that does work along latent coordinate {index}",
            TexUnit(units.input[index - 1])
        ),
    }));
    list.push(Entry {
        symbol: r"$\mathbf{x}$, $\mathbf{u}$".to_owned(),
        meaning: r"robot state and generalised input in SI units; $\mathbf{u} = \mathbf{L}\,\mathbf{u}_{\mathrm{lat}}$ with the constant matrix $\mathbf{L}$ of the generated code".to_owned(),
    });
    list.push(Entry {
        symbol: r"$\mathbf{W}_e$, $\mathbf{b}_e$".to_owned(),
        meaning: r"encoder in these units, $\mathbf{z} = \mathbf{W}_e \mathbf{x} + \mathbf{b}_e$"
            .to_owned(),
    });
    list
}

fn symbol(symbols: &SymbolTable, quantity: Quantity, index: usize) -> String {
    format!(
        "${}$",
        TexSymbol(&symbols.symbol(Variable { quantity, index }))
    )
}

/// `$z_1, \dots, z_6$`, or all of up to three.
fn range(symbols: &SymbolTable, quantity: Quantity, dim: usize) -> String {
    let show = |index| symbol(symbols, quantity, index);
    if dim <= 3 {
        (1..=dim).map(show).collect::<Vec<_>>().join(", ")
    } else {
        format!(r"{}, \dots, {}", show(1), show(dim))
    }
}

/// A latent coordinate and the robot coordinates that it mostly consists of.
fn coordinate(model: &ReducedModel, row: usize, numbers: NumberStyle) -> String {
    let (Ok(encoder), Some(state)) = (model.encoder(), model.state()) else {
        return format!("latent coordinate {}", row + 1);
    };
    let mut weights: Vec<(usize, f64)> = encoder
        .weights()
        .row(row)
        .iter()
        .copied()
        .enumerate()
        .collect();
    weights.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    let largest = weights.first().map_or(0.0, |(_, weight)| weight.abs());
    let strongest: Vec<String> = weights
        .iter()
        .take(STRONGEST)
        .filter(|(_, weight)| weight.abs() > NEGLIGIBLE * largest)
        .map(|(column, weight)| {
            let number = &Decimal::rounded(*weight, Rounding::default());
            let weight = TexNumber { number, numbers };
            format!(
                r"\texttt{{{}}} (${weight}$)",
                TexText(&state.names[*column])
            )
        })
        .collect();
    format!(
        "latent coordinate {}; largest weights: {}",
        row + 1,
        strongest.join(", ")
    )
}

fn robot_entries(model: &ReducedModel, numbers: NumberStyle) -> Vec<Entry> {
    let mut list = vec![
        robot_state(),
        Entry {
            symbol: r"$\mathbf{W}_e$, $\mathbf{b}_e$".to_owned(),
            meaning:
                r"encoder, $\mathbf{z} = \mathbf{W}_e (\mathbf{s}_x \mathbf{x}) + \mathbf{b}_e$"
                    .to_owned(),
        },
    ];
    list.extend(scale_factors(model, numbers));
    list
}

fn robot_state() -> Entry {
    Entry {
        symbol: r"$\mathbf{x}$, $\mathbf{u}$".to_owned(),
        meaning: "robot state and generalised input in SI units".to_owned(),
    }
}

/// A nonlinear encoder by the widths of its layers; its weights stay in the model file.
fn layers(encoder: &StateMap) -> Entry {
    let widths = encoder.layers().iter().map(|layer| {
        let width = layer.map.output_dim();
        match layer.activation {
            Activation::Linear => width.to_string(),
            Activation::Elu | Activation::Tanh | Activation::Sigmoid => {
                format!("{width} ({})", layer.activation)
            }
        }
    });
    let widths: Vec<String> = widths.collect();
    Entry {
        symbol: r"$\mathbf{E}$, $\mathbf{J}$".to_owned(),
        meaning: format!(
            r"nonlinear encoder, $\mathbf{{z}} = \mathbf{{E}}(\mathbf{{s}}_x \mathbf{{x}})$, and its Jacobian at $\mathbf{{s}}_x \mathbf{{x}}$; inputs {}, layers {}",
            encoder.input_dim(),
            widths.join(", ")
        ),
    }
}

fn scale_factors(model: &ReducedModel, numbers: NumberStyle) -> Vec<Entry> {
    let mut list = Vec::new();
    if let Ok(scaling) = model.scaling() {
        for (symbol, factors) in [("x", &scaling.state), ("u", &scaling.input)] {
            let value = match factors {
                ScaleFactors::Uniform(factor) => {
                    let number = &Decimal::exact(*factor);
                    format!("${}$ for all", TexNumber { number, numbers })
                }
                ScaleFactors::PerCoordinate(_) => "one a coordinate".to_owned(),
            };
            list.push(Entry {
                symbol: format!(r"$\mathbf{{s}}_{symbol}$"),
                meaning: format!(r"scale factors of $\mathbf{{{symbol}}}$: {value}"),
            });
        }
    }
    list
}
