//! From assigned tensors to the parts of a model.

mod layers;

use nalgebra::{DMatrix, DVector};

use super::assign::{Assigned, Assignment, assign};
use super::error::{ImportError, shape_text};
use super::layout::{self, Known, Subject};
use super::library;
use super::options::{ImportOptions, LibraryChoice, feet_text};
use super::report::{Layout, Note, UnusedTensor, UsedTensor};
use super::role::{Part, Role};
use super::tensors::{Array, Element, TensorFile};
use crate::model::{
    AffineMap, InputStatistics, Library, ModelError, Phase, ScaleFactors, Scaling, StateMap,
};
use crate::robot::STATE_DIM;

/// The parts of a model that a file has.
#[derive(Debug)]
pub(super) struct Parts {
    pub(super) library: Library,
    pub(super) phases: Vec<Phase>,
    pub(super) encoder: Option<StateMap>,
    pub(super) decoder: Option<StateMap>,
    pub(super) scaling: Option<Scaling>,
    pub(super) statistics: Vec<(String, InputStatistics)>,
}

/// What is said about the tensors of a file.
#[derive(Debug, Default)]
pub(super) struct ImportNotes {
    pub(super) used: Vec<UsedTensor>,
    pub(super) unused: Vec<UnusedTensor>,
    pub(super) notes: Vec<Note>,
}

/// Makes the parts of a model out of a file of tensors.
pub(super) fn parts(
    tensors: &TensorFile<'_>,
    options: &ImportOptions,
) -> Result<(Parts, ImportNotes), ImportError> {
    let assignment = assign(tensors, options)?;
    let mut assembly = Assembly {
        tensors,
        options,
        assignment: &assignment,
        known: Known {
            latent: options.latent_dim,
            state: options.robot.map(|_| STATE_DIM),
        },
        news: ImportNotes::default(),
    };
    let parts = assembly.parts()?;
    let mut news = assembly.news;
    news.unused = (assignment.unused.iter())
        .map(|info| UnusedTensor {
            tensor: info.name.clone(),
            shape: info.shape.clone(),
        })
        .collect();
    Ok((parts, news))
}

struct Assembly<'a, 'f> {
    tensors: &'f TensorFile<'f>,
    options: &'a ImportOptions,
    assignment: &'a Assignment<'f>,
    known: Known,
    news: ImportNotes,
}

impl<'f> Assembly<'_, 'f> {
    fn parts(&mut self) -> Result<Parts, ImportError> {
        let encoder = self.map(Part::Encoder)?;
        let decoder = self.map(Part::Decoder)?;
        self.check_activation(&[&encoder, &decoder])?;
        let weights: Vec<Layout> = (self.news.used.iter())
            .filter(|used| used.role.ends_with(".weight"))
            .map(|used| used.layout)
            .collect();
        if weights.contains(&Layout::Row) && weights.contains(&Layout::Column) {
            self.news.notes.push(Note::MixedWeights);
        }
        let (library, phases) = self.coefficients()?;
        let statistics = self.statistics()?;
        let scaling = self.scaling()?;
        Ok(Parts {
            library,
            phases,
            encoder,
            decoder,
            scaling,
            statistics,
        })
    }

    /// Complains about an activation that there is no place for.
    fn check_activation(&self, maps: &[&Option<StateMap>]) -> Result<(), ImportError> {
        let is_deep = |map: &&Option<StateMap>| map.as_ref().is_some_and(|m| m.layers().len() > 1);
        match self.options.activation {
            Some(activation) if !maps.iter().any(is_deep) => Err(ImportError::Option {
                option: "--activation",
                found: format!("{activation}, but no map with several layers"),
                expected: "tensors of layers, such as encoder.0.weight and encoder.2.weight"
                    .to_owned(),
            }),
            _ => Ok(()),
        }
    }

    fn find(&self, role: &Role) -> Option<Assigned<'f>> {
        self.assignment.find(role).cloned()
    }

    /// Reads a tensor for its role.
    fn read(&self, assigned: &Assigned<'f>) -> Result<Array, ImportError> {
        if assigned.info.element == Element::Bool && !matches!(assigned.role, Role::Mask(_)) {
            return Err(ImportError::Element {
                file: self.tensors.file().to_owned(),
                tensor: assigned.info.name.clone(),
                role: assigned.role.to_string(),
                found: assigned.info.element.name().to_owned(),
                expected: "f32 or f64",
            });
        }
        self.tensors.read(assigned.info, &assigned.role.to_string())
    }

    fn tell(&mut self, assigned: &Assigned<'f>, layout: Layout) {
        self.news.used.push(UsedTensor {
            role: assigned.role.to_string(),
            tensor: assigned.info.name.clone(),
            shape: assigned.info.shape.clone(),
            element: assigned.info.element.name().to_owned(),
            chosen: assigned.chosen,
            layout,
        });
    }

    fn model_error(&self, source: ModelError) -> ImportError {
        ImportError::Model {
            file: self.tensors.file().to_owned(),
            source: Box::new(source),
        }
    }

    /// Encoder or decoder, if the file has its weights.
    fn map(&mut self, part: Part) -> Result<Option<StateMap>, ImportError> {
        let tensors = self.layers_of(part);
        if !tensors.is_empty() {
            let Some(activation) = self.options.activation else {
                let found: Vec<String> = tensors.iter().map(|a| a.info.describe()).collect();
                return Err(ImportError::Layers {
                    file: self.tensors.file().to_owned(),
                    part: part.name(),
                    found: found.join(", "),
                });
            };
            return self.network(part, &tensors, activation).map(Some);
        }
        let bias = self.find(&Role::Bias(part));
        let Some(weights) = self.find(&Role::Weights(part)) else {
            if bias.is_some() {
                return Err(ImportError::Missing {
                    file: self.tensors.file().to_owned(),
                    role: Role::Weights(part).to_string(),
                    available: self.tensors.listing(),
                });
            }
            self.news.notes.push(Note::NoMap { part: part.name() });
            return Ok(None);
        };
        let role = weights.role.to_string();
        let subject = Subject {
            file: self.tensors.file(),
            info: weights.info,
            role: &role,
        };
        let found = layout::weights(subject, part, self.options.weights, self.known)?;
        let (latent, state) = found.dims;
        self.known = Known {
            latent: Some(latent),
            state: Some(state),
        };
        let stored = self.read(&weights)?.matrix(found.stored.0, found.stored.1);
        let matrix = match found.layout {
            Layout::Row => stored.transpose(),
            _ => stored,
        };
        self.tell(&weights, found.layout);
        let bias = match bias {
            Some(bias) => self.list(&bias, matrix.nrows())?,
            None => {
                self.news.notes.push(Note::ZeroBias { part: part.name() });
                DVector::zeros(matrix.nrows())
            }
        };
        let map = AffineMap::new(part.name(), matrix, bias);
        map.map(|map| Some(map.into()))
            .map_err(|source| self.model_error(source))
    }

    /// A tensor that is a list of `length` numbers.
    fn list(
        &mut self,
        assigned: &Assigned<'f>,
        length: usize,
    ) -> Result<DVector<f64>, ImportError> {
        let role = assigned.role.to_string();
        let subject = Subject {
            file: self.tensors.file(),
            info: assigned.info,
            role: &role,
        };
        layout::check_list(subject, length)?;
        let values = self.read(assigned)?.values;
        self.tell(assigned, Layout::Plain);
        Ok(DVector::from_vec(values))
    }

    /// Library and phases.
    fn coefficients(&mut self) -> Result<(Library, Vec<Phase>), ImportError> {
        let first = &self.assignment.phases[0].name;
        let first = self
            .find(&Role::Xi(first.clone()))
            .expect("every phase was assigned coefficients");
        let choice = match &self.options.library {
            Some(choice) => choice.clone(),
            None => return Err(self.no_library(&first)),
        };
        let mut phases = Vec::new();
        for rule in &self.assignment.phases {
            let xi = self.xi(&rule.name, &choice)?;
            if self.options.phases.is_empty() {
                self.news.notes.push(Note::UsualFeet {
                    phase: rule.name.clone(),
                    feet: feet_text(&rule.feet),
                });
            }
            phases.push(Phase {
                name: rule.name.clone(),
                feet: rule.feet.clone(),
                xi,
            });
        }
        let latent_dim = self.known.latent.expect("coefficients tell the dimension");
        let library = library::build(&choice, latent_dim)
            .map_err(|source| self.model_error(source.into()))?;
        let mut moved = false;
        for phase in &mut phases {
            let xi = std::mem::replace(&mut phase.xi, DMatrix::zeros(0, 0));
            let (xi, has_moved) = library::reorder(&choice, latent_dim, xi);
            phase.xi = xi;
            moved |= has_moved;
        }
        if moved {
            self.news.notes.push(Note::PaperOrder);
        }
        Ok((library, phases))
    }

    /// Coefficients of a phase in the file's order of terms, `library_dim x latent_dim`.
    fn xi(&mut self, phase: &str, choice: &LibraryChoice) -> Result<DMatrix<f64>, ImportError> {
        let assigned = self
            .find(&Role::Xi(phase.to_owned()))
            .expect("every phase was assigned coefficients");
        let (xi, layout) = self.terms_by_latent(&assigned, choice)?;
        self.known.latent = Some(xi.ncols());
        self.tell(&assigned, layout);
        let Some(assigned) = self.find(&Role::Mask(phase.to_owned())) else {
            return Ok(xi);
        };
        let (mask, layout) = self.terms_by_latent(&assigned, choice)?;
        if let Some(position) = mask.iter().position(|&flag| flag != 0.0 && flag != 1.0) {
            let (row, column) = mask.vector_to_matrix_index(position);
            return Err(ImportError::Value {
                file: self.tensors.file().to_owned(),
                tensor: assigned.info.name.clone(),
                role: assigned.role.to_string(),
                index: match layout {
                    Layout::LatentByTerms => [column, row].into(),
                    _ => [row, column].into(),
                },
                found: mask[(row, column)],
                expected: "0 or 1",
            });
        }
        self.tell(&assigned, layout);
        let off = |value: &f64, flag: &f64| *flag == 0.0 && *value != 0.0;
        let count = xi.iter().zip(&mask).filter(|(v, f)| off(v, f)).count();
        self.news.notes.push(Note::Masked {
            phase: phase.to_owned(),
            count,
        });
        Ok(xi.zip_map(&mask, |value, flag| if flag == 0.0 { 0.0 } else { value }))
    }

    /// A tensor of one number a term and latent coordinate.
    fn terms_by_latent(
        &self,
        assigned: &Assigned<'f>,
        choice: &LibraryChoice,
    ) -> Result<(DMatrix<f64>, Layout), ImportError> {
        let role = assigned.role.to_string();
        let subject = Subject {
            file: self.tensors.file(),
            info: assigned.info,
            role: &role,
        };
        let latent = self.known.latent;
        let found = layout::xi(
            subject,
            self.options.xi_layout,
            latent,
            |latent_dim| library::dim(choice, latent_dim),
            || self.expected_xi(choice),
        )?;
        let stored = self.read(assigned)?.matrix(found.stored.0, found.stored.1);
        let matrix = match found.layout {
            Layout::LatentByTerms => stored.transpose(),
            _ => stored,
        };
        Ok((matrix, found.layout))
    }

    fn expected_xi(&self, choice: &LibraryChoice) -> String {
        let source = library::describe(choice);
        let latent = self.known.latent.map_or("d".to_owned(), |d| d.to_string());
        let terms = match (choice, self.known.latent) {
            (LibraryChoice::Terms(terms), _) => terms.len().to_string(),
            (LibraryChoice::Standard(..), None) => "terms".to_owned(),
            (LibraryChoice::Standard(..), Some(latent)) => library::dim(choice, latent)
                .map_or_else(|| "terms".to_owned(), |count| count.to_string()),
        };
        format!("{terms} x {latent} or {latent} x {terms} (library: {source})")
    }

    fn no_library(&self, first: &Assigned<'f>) -> ImportError {
        let shape = &first.info.shape;
        let latent = self.known.latent.or(shape.iter().copied().min());
        let suggestions = match (latent, shape.as_slice()) {
            (Some(latent), &[rows, columns]) if latent == rows || latent == columns => {
                let terms = if latent == columns { rows } else { columns };
                library::standards_with(terms, latent)
            }
            _ => Vec::new(),
        };
        let mut expected =
            "--library degree=N[,trigonometric][,inputs] or --library FILE with the list of terms"
                .to_owned();
        if !suggestions.is_empty() {
            expected.push_str(&format!(
                "; for this shape perhaps --library {}",
                suggestions.join(" or ")
            ));
        }
        ImportError::NoLibrary {
            file: self.tensors.file().to_owned(),
            found: format!("`{}` ({})", first.info.name, shape_text(shape)),
            expected,
        }
    }

    fn statistics(&mut self) -> Result<Vec<(String, InputStatistics)>, ImportError> {
        let mut all = Vec::new();
        for rule in &self.assignment.phases {
            let mean = Role::InputMean(rule.name.clone());
            let covariance = Role::InputCovariance(rule.name.clone());
            let (mean, covariance) = match (self.find(&mean), self.find(&covariance)) {
                (None, None) => continue,
                (Some(mean), Some(covariance)) => (mean, covariance),
                (Some(_), None) => return Err(self.missing(&covariance)),
                (None, Some(_)) => return Err(self.missing(&mean)),
            };
            let dim = match (self.known.state, &mean.info.shape[..]) {
                (Some(dim), _) => dim,
                (None, shape) => shape.first().copied().unwrap_or(0),
            };
            let mean = self.list(&mean, dim)?;
            let role = covariance.role.to_string();
            let subject = Subject {
                file: self.tensors.file(),
                info: covariance.info,
                role: &role,
            };
            if covariance.info.shape != [dim, dim] {
                return Err(subject.shape_error(format!("{dim} x {dim}")));
            }
            let covariance_matrix = self.read(&covariance)?.matrix(dim, dim);
            self.tell(&covariance, Layout::Plain);
            let statistics = InputStatistics {
                mean,
                covariance: covariance_matrix,
            };
            all.push((rule.name.clone(), statistics));
        }
        Ok(all)
    }

    fn missing(&self, role: &Role) -> ImportError {
        ImportError::Missing {
            file: self.tensors.file().to_owned(),
            role: role.to_string(),
            available: self.tensors.listing(),
        }
    }

    /// Scale factors from tensors, or as given.
    fn scaling(&mut self) -> Result<Option<Scaling>, ImportError> {
        let (state, input) = match (
            self.find(&Role::StateScaling),
            self.find(&Role::InputScaling),
        ) {
            (None, None) => return Ok(self.options.scaling.clone()),
            (Some(state), Some(input)) => (state, input),
            (Some(_), None) => return Err(self.missing(&Role::InputScaling)),
            (None, Some(_)) => return Err(self.missing(&Role::StateScaling)),
        };
        if self.options.scaling.is_some() {
            return Err(ImportError::Option {
                option: "--scaling",
                found: "factors here and in tensors".to_owned(),
                expected: "one of the two".to_owned(),
            });
        }
        Ok(Some(Scaling {
            state: self.factors(&state)?,
            input: self.factors(&input)?,
        }))
    }

    fn factors(&mut self, assigned: &Assigned<'f>) -> Result<ScaleFactors, ImportError> {
        let count: usize = assigned.info.shape.iter().product();
        if count == 1 {
            let factors = self.list(assigned, 1)?;
            return Ok(ScaleFactors::Uniform(factors[0]));
        }
        let dim = self.known.state.unwrap_or(count);
        Ok(ScaleFactors::PerCoordinate(self.list(assigned, dim)?))
    }
}
