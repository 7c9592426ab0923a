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
    let figure = |id: &str, caption: &str, panels: Vec<Panel>| Figure {
        x_label: "latent coordinates".to_owned(),
        panel_size: (360.0, 210.0),
        columns: 2,
        ..Figure::over_time(id, caption, panels, &LEGEND)
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

/// Lower end, middle and upper end of a bar.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::figures::Drawing;

    #[test]
    fn bars_reach_a_standard_deviation_to_either_side_and_do_not_join() {
        let spread = |mean, std| Spread { mean, std };
        let row = |latent_dim, active| DimensionSummary {
            latent_dim,
            trained: 5,
            refused: 0,
            decoder_mse: spread(1e-4, 2e-4),
            active,
            combined_loss: spread(1.0, 0.0),
            torque_r2: spread(0.9, 0.0),
            prediction_x_m: spread(0.002, 0.001),
            prediction_z_m: spread(0.002, 0.001),
        };
        let summary = Summary {
            lambda: 0.001,
            dimensions: vec![row(1, spread(10.0, 2.0)), row(2, spread(20.0, 3.0))],
        };
        let figures = study_figures(&summary);
        let [decoder, active] = [0, 1].map(|panel| match &figures[0].panels[panel].drawing {
            Drawing::Lines { series, .. } => series,
            other => panic!("{other:?}"),
        });
        let [bars, means] = [0, 1].map(|line| active[line].points.as_slice());
        assert_eq!(
            bars[..3],
            [(1.0, Some(8.0)), (1.0, Some(12.0)), (1.0, None)]
        );
        assert_eq!(means, [(1.0, Some(10.0)), (2.0, Some(20.0))]);
        assert_eq!(decoder[0].points[0], (1.0, Some(-5.0)));
    }
}
