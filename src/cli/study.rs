//! `romc study`: trainings over latent dimensions and seeds, joined and summarised.

use std::path::Path;

use serde_json::{Value, json};

use super::Answer;
use super::args::{StudyArguments, TrainSettings};
use super::destination::Inputs;
use super::output::{note, spinner};
use super::prepared_recordings::RecordedSets;
use super::train_settings;
use crate::Error;
use crate::files::{EmittedFile, check_folder};
use crate::recording::Recording;
use crate::report::{figure_files, study_figures};
use crate::study::{self, CellId, FOLDS, Outcome, Plan, Shard, Spread, Store, Summary, cell_table};
use crate::train::{Method, Origin};
use crate::typeset::{Cell, Table, significant};

const TABLES: [&str; 2] = ["cells.csv", "summary.csv"];

pub(crate) fn run(arguments: &StudyArguments) -> Result<Answer, Error> {
    check_folder(&arguments.out_dir, &TABLES, arguments.force)?;
    let store = match arguments.merge.is_empty() {
        true => trained(arguments)?,
        false => merged(arguments)?,
    };
    let cells = store.cells()?;
    let summary = Summary::of(&cells, arguments.lambda);
    let tables = [cell_table(&cells, arguments.lambda), summary.table()];
    let tables = TABLES.iter().zip(tables);
    let tables = tables.map(|(name, table)| EmittedFile::new(*name, table.csv()));
    let mut files: Vec<EmittedFile> = tables.collect();
    files.extend(study_figures(&summary).iter().flat_map(figure_files));
    Inputs::default()
        .and(&arguments.recordings)
        .and(&arguments.validation)
        .and(&arguments.config)
        .and(&arguments.reading.columns)
        .and_robot(arguments.robot.as_deref())
        .write_folder(&arguments.out_dir, &files, arguments.force)?;
    Ok(answer(&arguments.out_dir, &store, &cells, &summary))
}

fn merged(arguments: &StudyArguments) -> Result<Store, Error> {
    let parts = arguments.merge.iter().map(|folder| Store::open(folder));
    let parts = parts.collect::<Result<Vec<_>, _>>()?;
    let plan = parts.first().expect("clap asks for at least one").plan();
    let store = Store::create(&arguments.out_dir, plan.clone())?;
    for part in &parts {
        store.merge(part)?;
    }
    Ok(store)
}

fn trained(arguments: &StudyArguments) -> Result<Store, Error> {
    let mut settings = settings(arguments)?;
    let robot = train_settings::robot(&settings)?;
    let mut recorded = RecordedSets::whole(
        [&arguments.recordings, &arguments.validation, &[]],
        &arguments.reading,
        &settings,
        robot,
    )?;
    recorded.read()?;
    recorded.report_findings();
    let [training, validation, _] = &recorded.sets;
    let [training, validation] = [training, validation].map(|set| &set.recordings[..]);
    let mut base = train_settings::options(&settings, 1, String::new(), robot)?;
    train_settings::identified(&mut base, &settings, &recorded, robot)?;
    settings.wrench_frame = Some(base.wrench_frame);
    settings.actuators = Some(train_settings::actuators(&settings).to_owned());
    let plan = plan(arguments, &settings, training, validation);
    if plan.method == Method::ClosedForm && plan.seeds > FOLDS {
        let message = "has seeds from 6 on leave out the jumps of seeds 1 to 5 again";
        note(&format!(
            "--seeds {}: the closed form {message}",
            plan.seeds
        ));
    }
    let store = Store::create(&arguments.out_dir, plan)?;
    let bar = spinner("training");
    let total = store.plan().cells().len();
    let finished = |_| {
        let left = store.missing().len();
        bar.set_message(format!("{} of {total} models trained", total - left));
    };
    let shard = arguments.shard.unwrap_or(Shard::WHOLE);
    let sets = [training, validation];
    study::run(&store, shard, sets, robot, &base, &finished)?;
    bar.finish_and_clear();
    Ok(store)
}

fn settings(arguments: &StudyArguments) -> Result<TrainSettings, Error> {
    let mut settings = TrainSettings::default();
    if let Some(path) = &arguments.config {
        settings = train_settings::read(path)?;
        if let Some(name) = train_settings::first(&settings, &["latent-dim", "seed", "seeds"]) {
            let message = format!("`{name}` is not a setting of a study, which runs over them");
            return Err(Error::refused(path, message));
        }
    }
    settings.paper |= arguments.paper;
    settings.method = arguments.method.or(settings.method);
    settings.robot = arguments.robot.clone().or(settings.robot);
    train_settings::check_pairs(&settings)?;
    settings.method = Some(train_settings::method(&settings));
    Ok(settings)
}

fn plan(
    arguments: &StudyArguments,
    settings: &TrainSettings,
    training: &[Recording],
    validation: &[Recording],
) -> Plan {
    let files = training
        .iter()
        .chain(validation)
        .map(|recording| &recording.path);
    let recordings = Origin::new("", files).recordings.into_iter();
    Plan {
        latent_dims: arguments.latent_dims.0.clone(),
        seeds: arguments.seeds,
        method: train_settings::method(settings),
        settings: train_settings::as_flags(settings),
        recordings: recordings.map(|file| file.digest).collect(),
        training: training.len(),
        romc: env!("CARGO_PKG_VERSION").to_owned(),
    }
}

fn answer(folder: &Path, store: &Store, cells: &[study::Cell], summary: &Summary) -> Answer {
    let spread = |Spread { mean, std }: Spread| -> Cell {
        format!("{} +- {}", significant(mean), significant(std)).into()
    };
    let table = Table::of(&summary.dimensions)
        .column("d", "", |row| row.latent_dim)
        .column("models", "", |row| row.trained)
        .column("decoder mean square", "", |row| spread(row.decoder_mse))
        .column("active in contact", "", |row| spread(row.active))
        .column("L_mod", "", |row| spread(row.combined_loss))
        .column("x after 0.1 s", "m", |row| spread(row.prediction_x_m))
        .column("z after 0.1 s", "m", |row| spread(row.prediction_z_m))
        .column("torque R^2", "", |row| spread(row.torque_r2))
        .table();
    let (missing, total) = (store.missing(), store.plan().cells().len());
    let best = summary.best();
    let mut text = format!(
        "{}: {} of {total} trainings finished\n\n{table}",
        folder.display(),
        total - missing.len()
    );
    if let Some(best) = best {
        text += &format!(
            "\nleast L_mod = 2 E_dec + 2 * {} * log |Xi| at d = {best}\n",
            summary.lambda
        );
    }
    let names: Vec<String> = (missing.iter())
        .map(|id| format!("d = {} seed {}", id.latent_dim, id.seed))
        .collect();
    if !names.is_empty() {
        text += &format!("\nnot trained yet: {}\n", names.join("; "));
    }
    let refused = cells.iter().filter_map(|cell| match &cell.outcome {
        Outcome::Refused(reason) => Some((cell.id, reason)),
        Outcome::Trained(_) => None,
    });
    let refused: Vec<(CellId, &String)> = refused.collect();
    for (id, reason) in &refused {
        text += &format!(
            "no model: d = {} seed {}: {reason}\n",
            id.latent_dim, id.seed
        );
    }
    let refused: Vec<Value> = (refused.iter())
        .map(|(id, reason)| json!({ "latent_dim": id.latent_dim, "seed": id.seed, "reason": reason }))
        .collect();
    let json = json!({
        "folder": folder.display().to_string(),
        "plan": store.plan(),
        "summary": summary,
        "least_combined_loss_at": best,
        "missing": missing,
        "refused": refused,
    });
    Answer::new(text, json)
}
