//! `romc study`: trainings over latent dimensions and seeds, joined and summarised.

use std::sync::atomic::AtomicBool;

use super::*;
use crate::study::{self, Outcome, Plan};

const TABLES: [&str; 2] = ["cells.csv", "summary.csv"];

pub(super) fn run(arguments: &StudyArguments) -> Result<Answer> {
    check_folder(&arguments.out_dir, &TABLES, arguments.force)?;
    let store = match arguments.merge.is_empty() {
        true => trained(arguments)?,
        false => merged(arguments)?,
    };
    let cells = store.cells()?;
    let summary = Summary::of(&cells, arguments.lambda);
    let [of_cells, of_summary] = TABLES;
    let mut files = vec![
        EmittedFile::new(of_cells, cell_table(&cells, arguments.lambda).csv()),
        EmittedFile::new(of_summary, summary.table().csv()),
    ];
    files.extend(study_figures(&summary).iter().flat_map(figure_files));
    Inputs::reading(&arguments.reading)
        .and(&arguments.recordings)
        .and(&arguments.validation)
        .and(&arguments.config)
        .and_robot(arguments.robot.as_deref())
        .write_folder(&arguments.out_dir, &files, arguments.force)?;
    Ok(answer(&arguments.out_dir, &store, &cells, &summary))
}

fn merged(arguments: &StudyArguments) -> Result<Store> {
    let parts = arguments.merge.iter().map(|folder| Store::open(folder));
    let parts = parts.collect::<Result<Vec<_>, _>>()?;
    let first = parts.first().expect("clap asks for at least one");
    let store = Store::create(&arguments.out_dir, first.plan.clone())?;
    for part in &parts {
        store.merge(part)?;
    }
    Ok(store)
}

fn trained(arguments: &StudyArguments) -> Result<Store> {
    let mut settings = settings(arguments)?;
    let robot = settings.robot()?;
    let sets = [&arguments.recordings, &arguments.validation, &[][..]];
    let mut recorded = RecordedSets::whole(sets, &arguments.reading, &settings, robot)?;
    recorded.read()?;
    recorded.report_findings();
    let [training, validation, _] = &recorded.sets;
    let [training, validation] = [training, validation].map(|set| &set.recordings[..]);
    let mut base = settings.options(1, String::new(), robot)?;
    settings.identify(&mut base, &recorded, robot)?;
    settings.check_phases(&mut base, training)?;
    settings.wrench_frame = Some(base.wrench_frame);
    settings.actuators = Some(settings.actuators().to_owned());
    let plan = plan(arguments, &settings, training, validation);
    if plan.method == Method::ClosedForm && plan.seeds > FOLDS {
        let seeds = plan.seeds;
        note(&format!(
            "--seeds {seeds}: the closed form has seeds from 6 on leave out the jumps of seeds 1 to 5 again"
        ));
    }
    let store = Store::create(&arguments.out_dir, plan)?;
    let shard = arguments.shard.unwrap_or(Shard::WHOLE);
    let missing = store.missing();
    let mut own = shard.of(&store.plan.cells());
    own.retain(|id| missing.contains(id));
    let bar = progress_bar("training models", own.len());
    let finished = |_| bar.inc(1);
    let sets = [training, validation];
    let never = AtomicBool::new(false);
    let stop = (arguments.reading.host.as_ref()).map_or(&never, |host| &host.stop);
    study::run(&store, shard, sets, robot, &base, (&finished, stop))?;
    bar.finish_and_clear();
    Ok(store)
}

fn settings(arguments: &StudyArguments) -> Result<TrainSettings> {
    let mut settings = TrainSettings::default();
    if let Some(path) = &arguments.config {
        settings = TrainSettings::read(path)?;
        if let Some(name) = settings.first("latent-dim seed seeds") {
            let message = format!("`{name}` is not a setting of a study, which runs over them");
            return Err(Error::refused(path, message));
        }
    }
    settings.paper |= arguments.paper;
    settings.method = arguments.method.or(settings.method);
    settings.robot = arguments.robot.clone().or(settings.robot);
    settings.check_pairs()?;
    settings.method = Some(settings.method());
    Ok(settings)
}

fn plan(
    arguments: &StudyArguments,
    settings: &TrainSettings,
    training: &[Recording],
    validation: &[Recording],
) -> Plan {
    let files = training.iter().chain(validation).map(|of| &of.path);
    let recordings = Origin::new("", files).recordings.into_iter();
    Plan {
        latent_dims: arguments.latent_dims.0.clone(),
        seeds: arguments.seeds,
        method: settings.method(),
        settings: settings.as_flags(),
        recordings: recordings.map(|file| file.digest).collect(),
        training: training.len(),
        romc: env!("CARGO_PKG_VERSION").to_owned(),
    }
}

fn answer(folder: &Path, store: &Store, cells: &[study::Cell], summary: &Summary) -> Answer {
    let spread = |Spread { mean, std }: Spread| -> Cell {
        format!("{} ± {}", significant(mean), significant(std)).into()
    };
    let table = Table::of(&summary.dimensions)
        .column("d", "", |row| row.latent_dim)
        .column("models", "", |row| row.trained)
        .column("decoder mean square", "", |row| spread(row.decoder_mse))
        .column("active in contact", "", |row| spread(row.active))
        .column("L_mod", "", |row| spread(row.combined_loss))
        .column("error of body x over 0.1 s", "m", |row| {
            spread(row.prediction_x_m)
        })
        .column("error of body z over 0.1 s", "m", |row| {
            spread(row.prediction_z_m)
        })
        .column("torque R^2", "", |row| spread(row.torque_r2))
        .table();
    let (missing, total) = (store.missing(), store.plan.cells().len());
    let (best, folder) = (summary.best(), folder.display().to_string());
    let id = |id: &CellId| format!("d = {} seed {}", id.latent_dim, id.seed);
    let finished = total - missing.len();
    let mut text = format!("{folder}: {finished} of {total} trainings finished\n\n{table}");
    if let Some(best) = best {
        let lambda = summary.lambda;
        text += &format!("\nleast L_mod = 2 E_dec + 2 * {lambda} * ln |Xi| at d = {best}\n");
    }
    if !missing.is_empty() {
        let missing: Vec<String> = missing.iter().map(id).collect();
        text += &format!("\nnot trained yet: {}\n", missing.join("; "));
    }
    let mut refused = Vec::new();
    for cell in cells {
        if let Outcome::Refused(reason) = &cell.outcome {
            text += &fitted(&format!("no model: {}: {reason}", id(&cell.id)));
            let CellId { latent_dim, seed } = cell.id;
            refused.push(json!({ "latent_dim": latent_dim, "seed": seed, "reason": reason }));
        }
    }
    let json = json!({
        "folder": folder,
        "plan": store.plan,
        "summary": summary,
        "least_combined_loss_at": best,
        "missing": missing,
        "refused": refused,
    });
    let has_no_model = missing.is_empty() && refused.len() == cells.len();
    Answer::new(text, json).failed_if(has_no_model)
}
