//! From assigned tensors to the parts of a model.

mod maps;
mod units;

use nalgebra::{DMatrix, DVector};

use super::assign::{Assigned, Assignment, assign};
use super::error::{ImportError, shape_text};
use super::library;
use super::options::{ImportOptions, PhaseRule, XiLayout, standard_text};
use super::report::{ImportReport, Layout, UnusedTensor, UsedTensor};
use super::role::{Part, Role, is_of_optimiser};
use super::tensors::{Element, TensorFile, TensorInfo};
use crate::files::Place;
use crate::model::{InputStatistics, Library, LibraryChoice, ModelError, Phase, Scaling, StateMap};
use crate::robot::STATE_DIM;

#[derive(Debug)]
pub(super) struct Parts {
    pub(super) library: Library,
    pub(super) phases: Vec<Phase>,
    pub(super) encoder: Option<StateMap>,
    pub(super) decoder: Option<StateMap>,
    pub(super) scaling: Option<Scaling>,
    pub(super) statistics: Vec<(String, InputStatistics)>,
}

impl Parts {
    pub(super) fn state_dim(&self) -> Option<usize> {
        (self.encoder.as_ref().map(StateMap::input_dim))
            .or(self.decoder.as_ref().map(StateMap::output_dim))
    }
}

#[derive(Clone, Copy, Debug, Default)]
struct Known {
    latent: Option<usize>,
    state: Option<usize>,
}

pub(super) fn parts(
    tensors: &TensorFile<'_>,
    options: &ImportOptions,
) -> Result<(Parts, ImportReport), ImportError> {
    if matches!(options.library, Some(LibraryChoice::Terms(_))) && options.library_order.is_some() {
        let found = "a list of terms, which has an order";
        let expected = "--library degree=N[,trigonometric][,inputs]";
        return Err(ImportError::option("--library-order", found, expected));
    }
    let assignment = assign(tensors, options)?;
    let mut assembly = Assembly {
        tensors,
        options,
        assignment: &assignment,
        known: Known {
            latent: options.latent_dim,
            state: options.robot.map(|_| STATE_DIM),
        },
        report: ImportReport::default(),
    };
    let (encoder, decoder) = assembly.maps()?;
    if encoder.is_none() && decoder.is_none() {
        assembly.check_options_of_maps()?;
    }
    let (library, phases) = assembly.coefficients()?;
    assembly.check_left_over([&encoder, &decoder], &phases)?;
    let statistics = assembly.statistics()?;
    let mut parts = Parts {
        library,
        phases,
        encoder,
        decoder,
        scaling: assembly.scaling()?,
        statistics,
    };
    assembly.fold_mean(&mut parts)?;
    assembly.sort(&mut parts)?;
    let mut report = assembly.report;
    let unused = assignment.unused.iter().map(|info| UnusedTensor {
        tensor: info.name.clone(),
        shape: info.shape.clone(),
    });
    report.unused = unused.collect();
    Ok((parts, report))
}

struct Assembly<'a, 'f> {
    tensors: &'a TensorFile<'f>,
    options: &'a ImportOptions,
    assignment: &'a Assignment<'a>,
    known: Known,
    report: ImportReport,
}

impl<'a> Assembly<'a, '_> {
    fn find(&self, role: &Role) -> Option<&'a Assigned<'a>> {
        let mut used = self.assignment.used.iter();
        used.find(|assigned| assigned.role == *role)
    }

    fn refused(
        &self,
        assigned: &Assigned<'_>,
        found: impl Into<Box<str>>,
        expected: impl Into<Box<str>>,
    ) -> ImportError {
        self.tensors.refused(assigned.place(&[]), found, expected)
    }

    fn unusable(&self, source: impl Into<ModelError>) -> ImportError {
        ImportError::unusable(self.tensors.file(), source)
    }

    fn wrong_shape(&self, assigned: &Assigned<'_>, expected: String) -> ImportError {
        self.refused(assigned, shape_text(&assigned.info.shape), expected)
    }

    /// The only way of storing a tensor that fits; a single number is stored the same in all ways.
    fn only_way<T: Copy>(
        &self,
        assigned: &Assigned<'_>,
        fitting: &[(Layout, T)],
        expected: impl FnOnce() -> String,
        option: &str,
    ) -> Result<(Layout, T), ImportError> {
        match fitting {
            [only] => Ok(*only),
            [] => Err(self.wrong_shape(assigned, expected())),
            [(_, first), ..] if assigned.info.shape == [1, 1] => Ok((Layout::Plain, *first)),
            _ => {
                let shape = shape_text(&assigned.info.shape);
                let found = format!("{shape}, a square matrix, whose shape fits both ways");
                Err(self.refused(assigned, found, option))
            }
        }
    }

    /// Reads a tensor for its role, stored as a matrix of `rows x columns`, as the model has it, and notes its use.
    fn read(
        &mut self,
        assigned: &Assigned<'_>,
        shape: (usize, usize),
        layout: Layout,
    ) -> Result<DMatrix<f64>, ImportError> {
        let info = assigned.info;
        if info.element == Element::Bool && !matches!(assigned.role, Role::Mask(_)) {
            return Err(self.refused(assigned, "numbers of type bool", "f32 or f64"));
        }
        let stored = (self.tensors).read(info, shape, |index| assigned.place(index))?;
        self.report.used.push(UsedTensor {
            role: assigned.role.to_string(),
            tensor: info.name.clone(),
            shape: info.shape.clone(),
            element: info.element.name().to_owned(),
            chosen: assigned.chosen,
            layout,
        });
        Ok(match layout {
            Layout::Row | Layout::LatentByTerms => stored.transpose(),
            Layout::Column | Layout::TermsByLatent | Layout::Plain => stored,
        })
    }

    /// A tensor that is a list of `length` numbers; a matrix of one row or column is one.
    fn list(
        &mut self,
        assigned: &Assigned<'_>,
        length: usize,
    ) -> Result<DVector<f64>, ImportError> {
        let is_list = match assigned.info.shape[..] {
            [] => length == 1,
            [found] | [1, found] | [found, 1] => found == length,
            _ => false,
        };
        if !is_list {
            return Err(self.wrong_shape(assigned, format!("{length} numbers")));
        }
        let values = self.read(assigned, (length, 1), Layout::Plain)?;
        Ok(values.column(0).into_owned())
    }

    fn coefficients(&mut self) -> Result<(Library, Vec<Phase>), ImportError> {
        let first = Role::Xi(self.assignment.phases[0].name.clone());
        let first = (self.find(&first)).expect("every phase was assigned coefficients");
        let options = self.options;
        let choice = (options.library.as_ref()).ok_or_else(|| self.no_library(first))?;
        let mut phases = Vec::new();
        for rule in &self.assignment.phases {
            let xi = self.xi(&rule.name, choice)?;
            let PhaseRule { name, feet } = rule.clone();
            self.report.notes.extend(options.usual_feet(&name, &feet));
            phases.push(Phase { name, feet, xi });
        }
        let latent_dim = phases[0].xi.ncols();
        let library = library::build(self.tensors.file(), choice, latent_dim)?;
        self.report.terms = self.sort_terms(&library, &mut phases)?;
        Ok((library, phases))
    }

    /// Brings the rows of coefficients over a standard library from the file's order into romc's;
    /// returns the terms in the file's order.
    fn sort_terms(
        &mut self,
        library: &Library,
        phases: &mut [Phase],
    ) -> Result<Vec<String>, ImportError> {
        let LibraryChoice::Standard(standard) = library.choice() else {
            let terms = library.terms().iter().map(|term| term.text().to_owned());
            return Ok(terms.collect());
        };
        let latent_dim = library.latent_dim();
        let order = library::order(standard, latent_dim, self.options.library_order)?;
        let rows = standard.rows_in(order, latent_dim);
        let rows = rows.map_err(|source| self.unusable(source))?;
        for phase in phases {
            let stored = phase.xi.clone();
            for (place, &row) in rows.iter().enumerate() {
                phase.xi.row_mut(row).copy_from(&stored.row(place));
            }
        }
        self.report.library_order = order.name();
        let terms = standard.texts_in(order, latent_dim);
        terms.map_err(|source| self.unusable(source))
    }

    /// Refuses options that are of use with an encoder or decoder alone.
    fn check_options_of_maps(&self) -> Result<(), ImportError> {
        let Some(option) = self.options.of_maps() else {
            return Ok(());
        };
        let unused = &self.assignment.unused;
        let unused: Vec<String> = unused.iter().take(24).map(|info| info.describe()).collect();
        let left = match unused.is_empty() {
            true => "no tensor is left".to_owned(),
            false => format!("left are {}", unused.join(", ")),
        };
        let found = format!("{option}, but no tensor for encoder.weight or decoder.weight; {left}");
        let expected = format!("--map encoder.weight=TENSOR and so on, or no {option}");
        Err(self.tensors.refused(Place::Whole, found, expected))
    }

    /// Refuses unused tensors that by shape are a missing encoder or decoder, or by their numbers a mask.
    fn check_left_over(
        &self,
        maps: [&Option<StateMap>; 2],
        phases: &[Phase],
    ) -> Result<(), ImportError> {
        let is_of_model = |info: &&&TensorInfo| !is_of_optimiser(&info.name);
        let mut unused = self.assignment.unused.iter().filter(is_of_model);
        let other = maps.iter().find_map(|map| map.as_ref());
        for (part, map) in Part::ALL.into_iter().zip(maps) {
            let (None, Some(other)) = (map, other) else {
                continue;
            };
            let (a, b) = (other.input_dim(), other.output_dim());
            let mut fitting = unused
                .clone()
                .filter(|info| info.shape == [a, b] || info.shape == [b, a]);
            if let Some(info) = fitting.next() {
                let name = part.name();
                let found = format!(
                    "no {name}, and {} unused, which has its shape",
                    info.describe()
                );
                let expected = format!("--map {name}.weight={}, or a file without it", info.name);
                return Err(self.tensors.refused(Place::Whole, found, expected));
            }
        }
        let Some(mask) = unused.find(|info| self.is_mask(info, &phases[0].xi)) else {
            return Ok(());
        };
        let (phase, described) = (&phases[0].name, mask.describe());
        let found = format!("{described} unused, zeros and ones in the shape of xi.{phase}");
        let expected = format!(
            "--map mask.{phase}={} (0 switches a coefficient off), or a file without it",
            mask.name
        );
        Err(self.tensors.refused(Place::Whole, found, expected))
    }

    /// Whether a tensor has the shape of coefficients and holds zeros and ones, both of them.
    fn is_mask(&self, info: &TensorInfo, xi: &DMatrix<f64>) -> bool {
        let (terms, latent) = xi.shape();
        let shape = match info.shape[..] {
            [rows, columns] if [(terms, latent), (latent, terms)].contains(&(rows, columns)) => {
                (rows, columns)
            }
            _ => return false,
        };
        let place = |_: &[usize]| Place::Whole;
        (self.tensors.read(info, shape, place)).is_ok_and(|values| {
            [0.0, 1.0]
                .iter()
                .all(|flag| values.iter().any(|v| v == flag))
                && values.iter().all(|&value| value == 0.0 || value == 1.0)
        })
    }

    /// Coefficients of a phase in the file's order of terms, `library_dim x latent_dim`.
    fn xi(&mut self, phase: &str, choice: &LibraryChoice) -> Result<DMatrix<f64>, ImportError> {
        let assigned = self.find(&Role::Xi(phase.to_owned()));
        let assigned = assigned.expect("every phase was assigned coefficients");
        let (xi, _) = self.terms_by_latent(assigned, choice)?;
        self.known.latent = Some(xi.ncols());
        let Some(assigned) = self.find(&Role::Mask(phase.to_owned())) else {
            return Ok(xi);
        };
        let (mask, layout) = self.terms_by_latent(assigned, choice)?;
        if let Some(position) = mask.iter().position(|&flag| flag != 0.0 && flag != 1.0) {
            let (row, column) = mask.vector_to_matrix_index(position);
            let place = match layout {
                Layout::LatentByTerms => assigned.place(&[column, row]),
                _ => assigned.place(&[row, column]),
            };
            let found = mask[position].to_string();
            return Err(self.tensors.refused(place, found, "0 or 1"));
        }
        let off = |(value, flag): &(&f64, &f64)| **flag == 0.0 && **value != 0.0;
        let count = xi.iter().zip(&mask).filter(off).count();
        let note = format!("the mask of phase {phase} switched {count} coefficients off");
        self.report.notes.push(note);
        Ok(xi.zip_map(&mask, |value, flag| if flag == 0.0 { 0.0 } else { value }))
    }

    fn terms_by_latent(
        &mut self,
        assigned: &Assigned<'_>,
        choice: &LibraryChoice,
    ) -> Result<(DMatrix<f64>, Layout), ImportError> {
        let (by_terms, by_latent) = (Layout::TermsByLatent, Layout::LatentByTerms);
        let mut ways = match assigned.info.shape[..] {
            [length] => vec![(Layout::Plain, (length, 1))],
            [rows, columns] => vec![(by_terms, (rows, columns)), (by_latent, (columns, rows))],
            _ => Vec::new(),
        };
        ways.retain(|(way, _)| match self.options.xi_layout {
            Some(XiLayout::TermsByLatent) => *way != by_latent,
            Some(XiLayout::LatentByTerms) => *way != by_terms,
            None => true,
        });
        ways.retain(|&(_, (terms, latent))| {
            latent > 0
                && self.known.latent.is_none_or(|known| known == latent)
                && library::dim(choice, latent) == Some(terms)
        });
        let option = "--xi-layout terms-by-latent (one row per term) or --xi-layout latent-by-terms \
                      (one row per latent coordinate)";
        let expected = || match assigned.info.shape.len() {
            3 => "one tensor per phase: in Python, {\"xi.contact\": Xi[0], \"xi.flight\": Xi[1]}"
                .to_owned(),
            _ => self.expected_xi(choice),
        };
        let (layout, (terms, latent)) = self.only_way(assigned, &ways, expected, option)?;
        let stored = match layout {
            Layout::LatentByTerms => (latent, terms),
            _ => (terms, latent),
        };
        Ok((self.read(assigned, stored, layout)?, layout))
    }

    fn expected_xi(&self, choice: &LibraryChoice) -> String {
        let latent = self.known.latent;
        let (terms, source) = match choice {
            LibraryChoice::Terms(terms) => {
                let count = terms.len();
                (Some(count), format!("a list of {count} terms"))
            }
            LibraryChoice::Standard(standard) => {
                let count = latent.and_then(|d| standard.term_count(d));
                (count, standard_text(*standard))
            }
        };
        let latent = latent.map_or("d".to_owned(), |d| d.to_string());
        let terms = terms.map_or("terms".to_owned(), |count| count.to_string());
        format!("{terms} x {latent} or {latent} x {terms} (library: {source})")
    }

    fn no_library(&self, first: &Assigned<'_>) -> ImportError {
        let shape = &first.info.shape;
        let latent = self.known.latent.or(shape.iter().copied().min());
        let suggestions = match (latent, shape.as_slice()) {
            (Some(d), &[terms, columns]) if d == columns => library::standards_with(terms, d),
            (Some(d), &[rows, terms]) if d == rows => library::standards_with(terms, d),
            _ => Vec::new(),
        };
        let mut expected =
            "--library degree=N[,trigonometric][,inputs] or --library FILE with the list of terms"
                .to_owned();
        if !suggestions.is_empty() {
            expected += "; for this shape perhaps --library ";
            expected += &suggestions.join(" or ");
        }
        let found = format!("no candidate terms for {}", first.info.describe());
        self.tensors.refused(Place::Whole, found, expected)
    }

    fn statistics(&mut self) -> Result<Vec<(String, InputStatistics)>, ImportError> {
        let mut all = Vec::new();
        for rule in &self.assignment.phases {
            let mean = Role::InputMean(rule.name.clone());
            let covariance = Role::InputCovariance(rule.name.clone());
            let (mean, covariance) = match (self.find(&mean), self.find(&covariance)) {
                (None, None) => continue,
                (Some(mean), Some(covariance)) => (mean, covariance),
                (Some(_), None) => return Err(self.tensors.missing(&covariance)),
                (None, Some(_)) => return Err(self.tensors.missing(&mean)),
            };
            let length = mean.info.shape.first().copied();
            let dim = self.known.state.or(length).unwrap_or(0);
            let mean = self.list(mean, dim)?;
            if covariance.info.shape != [dim, dim] {
                return Err(self.wrong_shape(covariance, format!("{dim} x {dim}")));
            }
            let statistics = InputStatistics {
                mean,
                covariance: self.read(covariance, (dim, dim), Layout::Plain)?,
                given_state: None,
            };
            all.push((rule.name.clone(), statistics));
        }
        Ok(all)
    }
}
