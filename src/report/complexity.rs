//! Accuracy against complexity over the latent dimension: figures 10 and 11 of the paper.

use super::figures::{Figure, Panel, Role, Series};
use crate::study::{DimensionSummary, Spread, Summary};

const LEGEND: [(Role, &str); 2] = [
    (Role::Recorded, "mean over seeds"),
    (Role::SecondBaseline, "standard deviation"),
];

/// Figures 10 (decoder error and active coefficients) and 11 (combined loss) of a study; bars are one standard deviation
/// over the seeds to either side.
pub(crate) fn study_figures(summary: &Summary) -> Vec<Figure> {
    let figure = |id: &str, caption: &str, panels: Vec<Panel>| {
        let figure = Figure::over_time(id, caption, panels, &LEGEND);
        figure
            .over("latent coordinates")
            .in_columns(2, (360.0, 210.0))
    };
    type Row = (&'static str, fn(&DimensionSummary) -> Bar);
    let over_dimensions: [Row; 4] = [
        ("log10 of decoder mean square, scaled units", |row| {
            logarithm(row.decoder_mse)
        }),
        ("active coefficients in contact", |row| range(row.active)),
        ("x after 0.1 s, mm", |row| millimetres(row.prediction_x_m)),
        ("z after 0.1 s, mm", |row| millimetres(row.prediction_z_m)),
    ];
    let rows = &summary.dimensions;
    let over_dimensions = over_dimensions.map(|(title, bar)| panel(title, rows, bar));
    let combined = panel("combined loss", rows, |row| range(row.combined_loss));
    let accuracy = "Accuracy against complexity over the latent dimension (figure 10 of the paper)";
    let loss = format!(
        "Combined loss 2 E_dec + 2 lambda log |Xi| with lambda = {} (figure 11 of the paper)",
        summary.lambda
    );
    vec![
        figure("complexity", accuracy, over_dimensions.into()),
        figure("combined-loss", &loss, vec![combined]),
    ]
}

type Bar = [f64; 3];

fn range(Spread { mean, std }: Spread) -> Bar {
    [mean - std, mean, mean + std]
}

fn millimetres(spread: Spread) -> Bar {
    range(spread).map(|metres| 1000.0 * metres)
}

/// Logarithms of a bar; one that reaches below zero ends at a tenth of its middle.
fn logarithm(spread: Spread) -> Bar {
    let [low, mean, high] = range(spread);
    [low.max(0.1 * mean), mean, high].map(f64::log10)
}

fn panel(title: &str, rows: &[DimensionSummary], bar: impl Fn(&DimensionSummary) -> Bar) -> Panel {
    let (mut means, mut bars) = (Vec::new(), Vec::new());
    for row in rows {
        let (x, [low, mean, high]) = (row.latent_dim as f64, bar(row));
        means.push((x, Some(mean)));
        bars.extend([(x, Some(low)), (x, Some(high)), (x, None)]);
    }
    let bars = Series::through(Role::SecondBaseline, bars);
    Panel::lines(title, vec![bars, Series::through(Role::Recorded, means)])
}
