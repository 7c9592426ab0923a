//! The folder of a study: its plan, and one file a finished training.

use std::io::ErrorKind;

use serde::de::DeserializeOwned;

use super::*;
use crate::files::size::{Format, read_text_capped};
use crate::files::{Overwrite, write_whole};

const PLAN: &str = "study.json";

pub(crate) struct Store {
    folder: PathBuf,
    pub(crate) plan: Plan,
}

impl Store {
    pub(crate) fn create(folder: &Path, plan: Plan) -> Result<Self> {
        plan.check()?;
        fs::create_dir_all(folder).map_err(refused(folder, "make the folder"))?;
        let path = folder.join(PLAN);
        match write_json(&path, &plan, Overwrite::Refuse) {
            Err(StudyError::File { source, .. }) if source.kind() == ErrorKind::AlreadyExists => {
                let found: Plan = read_json(&path)?;
                if let Some(difference) = difference(&found, &plan) {
                    return Err(StudyError::OtherStudy { path, difference });
                }
            }
            written => written?,
        }
        let folder = folder.to_owned();
        Ok(Self { folder, plan })
    }

    pub(crate) fn open(folder: &Path) -> Result<Self> {
        let plan: Plan = read_json(&folder.join(PLAN))?;
        plan.check()?;
        let folder = folder.to_owned();
        Ok(Self { folder, plan })
    }

    pub(crate) fn get(&self, id: CellId) -> Result<Option<Cell>> {
        let path = self.path(id);
        if !path.exists() {
            return Ok(None);
        }
        let cell: Cell = read_json(&path)?;
        if cell.id != id {
            let message = format!(
                "holds latent dimension {} and seed {}, expected {} and {}",
                cell.id.latent_dim, cell.id.seed, id.latent_dim, id.seed
            );
            return Err(StudyError::Broken { path, message });
        }
        Ok(Some(cell))
    }

    pub(crate) fn put(&self, cell: &Cell) -> Result<()> {
        write_json(&self.path(cell.id), cell, Overwrite::Replace)
    }

    pub(crate) fn cells(&self) -> Result<Vec<Cell>> {
        let ids = self.plan.cells().into_iter();
        ids.filter_map(|id| self.get(id).transpose()).collect()
    }

    pub(crate) fn missing(&self) -> Vec<CellId> {
        let cells = self.plan.cells().into_iter();
        cells.filter(|id| !self.path(*id).exists()).collect()
    }

    pub(crate) fn merge(&self, part: &Store) -> Result<()> {
        if let Some(difference) = difference(&part.plan, &self.plan) {
            let path = part.folder.join(PLAN);
            return Err(StudyError::OtherStudy { path, difference });
        }
        for cell in part.cells()? {
            match self.get(cell.id)? {
                None => self.put(&cell)?,
                Some(own) if own == cell => {}
                Some(_) => {
                    return Err(StudyError::Contradiction {
                        first: self.path(cell.id),
                        second: part.path(cell.id),
                    });
                }
            }
        }
        Ok(())
    }

    fn path(&self, CellId { latent_dim, seed }: CellId) -> PathBuf {
        (self.folder).join(format!("cell-d{latent_dim:02}-s{seed:02}.json"))
    }
}

fn difference(found: &Plan, expected: &Plan) -> Option<&'static str> {
    let sets = |plan: &Plan| (plan.recordings.clone(), plan.training);
    let dims = found.latent_dims != expected.latent_dims;
    let parts = [
        ("the versions of romc", found.romc != expected.romc),
        ("the methods", found.method != expected.method),
        ("the settings", found.settings != expected.settings),
        ("the recordings", sets(found) != sets(expected)),
        ("the latent dimensions", dims),
        ("the numbers of seeds", found.seeds != expected.seeds),
    ];
    let first = parts.into_iter().find(|(_, differs)| *differs);
    first.map(|(name, _)| name)
}

fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T> {
    let text = read_text_capped(path, Format::Model).map_err(refused(path, "read"))?;
    serde_json::from_str(&text).map_err(|error| StudyError::Broken {
        path: path.to_owned(),
        message: error.to_string(),
    })
}

fn write_json(path: &Path, value: &impl Serialize, overwrite: Overwrite) -> Result<()> {
    let text = serde_json::to_string_pretty(value).map_err(io::Error::from);
    let written = text.and_then(|text| write_whole(path, overwrite, |out| writeln!(out, "{text}")));
    written.map_err(refused(path, "write"))
}

fn refused(path: &Path, action: &'static str) -> impl Fn(io::Error) -> StudyError {
    move |source| StudyError::File {
        path: path.to_owned(),
        action,
        source,
    }
}
