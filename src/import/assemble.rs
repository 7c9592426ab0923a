//! From assigned tensors to the parts of a model.

mod maps;

use super::assign::{Assigned, Assignment, assign};
use super::run::{Layout, UnusedTensor, UsedTensor};
use super::tensors::shape_text;
use super::*;
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
) -> Read<(Parts, ImportReport)> {
    if matches!(options.library, Some(LibraryChoice::Terms(_))) && options.library_order.is_some() {
        let found = "a list of terms, which has an order";
        let expected = "--library degree=N[,trigonometric][,inputs]";
        return Err(ImportError::option("--library-order", found, expected));
    }
    let assignment = assign(tensors, options)?;
    let (latent, state) = (options.latent_dim, options.robot.map(|_| STATE_DIM));
    let mut assembly = Assembly {
        tensors,
        options,
        assignment: &assignment,
        known: Known { latent, state },
        report: ImportReport::default(),
    };
    let (encoder, decoder) = assembly.maps()?;
    if encoder.is_none() && decoder.is_none() {
        assembly.check_options_of_maps()?;
    }
    let (library, phases) = assembly.coefficients()?;
    let mut parts = Parts {
        library,
        phases,
        encoder,
        decoder,
        scaling: None,
        statistics: Vec::new(),
    };
    assembly.check_left_over(&parts)?;
    parts.statistics = assembly.statistics()?;
    parts.scaling = assembly.scaling()?;
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
        ImportError::unusable(&self.tensors.file, source)
    }

    fn note(&mut self, note: impl Into<String>) {
        self.report.notes.push(note.into());
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
    ) -> Read<(Layout, T)> {
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
    ) -> Read<DMatrix<f64>> {
        let info = assigned.info;
        if info.element.0 == "bool" && !matches!(assigned.role, Role::Mask(_)) {
            return Err(self.refused(assigned, "numbers of type bool", "f32 or f64"));
        }
        let stored = (self.tensors).read(info, shape, |index| assigned.place(index))?;
        self.report.used.push(UsedTensor {
            role: assigned.role.to_string(),
            tensor: info.name.clone(),
            shape: info.shape.clone(),
            element: info.element.0.clone(),
            chosen: assigned.chosen,
            layout,
        });
        Ok(match layout {
            Layout::Row | Layout::LatentByTerms => stored.transpose(),
            Layout::Column | Layout::TermsByLatent | Layout::Plain => stored,
        })
    }

    /// A tensor that is a list of `length` numbers; a matrix of one row or column is one.
    fn list(&mut self, assigned: &Assigned<'_>, length: usize) -> Read<DVector<f64>> {
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

    fn coefficients(&mut self) -> Read<(Library, Vec<Phase>)> {
        let first = Role::Xi(self.assignment.phases[0].name.clone());
        let first = (self.find(&first)).expect("every phase was assigned coefficients");
        let options = self.options;
        let choice = (options.library.as_ref()).ok_or_else(|| self.no_library(first))?;
        let mut phases = Vec::new();
        for rule in &self.assignment.phases {
            let xi = self.xi(&rule.name, choice)?;
            let PhasePattern { name, feet } = rule.clone();
            self.report.notes.extend(options.usual_feet(&name, &feet));
            phases.push(Phase { name, feet, xi });
        }
        let latent_dim = phases[0].xi.ncols();
        let library = library::build(&self.tensors.file, choice, latent_dim)?;
        self.report.terms = self.sort_terms(&library, &mut phases)?;
        Ok((library, phases))
    }

    /// Brings rows over a standard library from the file's order into romc's; returns the terms in the file's order.
    fn sort_terms(&mut self, library: &Library, phases: &mut [Phase]) -> Read<Vec<String>> {
        let LibraryChoice::Standard(standard) = library.choice() else {
            let terms = library.terms().iter().map(|term| term.text.clone());
            return Ok(terms.collect());
        };
        let latent_dim = library.latent_dim();
        let order = library::order(standard, latent_dim, self.options.library_order)?;
        let sorted = (standard.rows_in(order, latent_dim))
            .and_then(|rows| Ok((rows, standard.texts_in(order, latent_dim)?)));
        let (rows, terms) = sorted.map_err(|source| self.unusable(source))?;
        for phase in phases {
            let stored = phase.xi.clone();
            for (place, &row) in rows.iter().enumerate() {
                phase.xi.row_mut(row).copy_from(&stored.row(place));
            }
        }
        self.report.library_order = order.name();
        Ok(terms)
    }

    fn check_options_of_maps(&self) -> Read<()> {
        const OF_MAPS: [&str; 5] = [
            "--robot",
            "--scaling",
            "--input-scaling",
            "--order",
            "--weights",
        ];
        let Some(option) = self.options.first_of(&OF_MAPS) else {
            return Ok(());
        };
        let unused = self.assignment.unused.iter().take(24);
        let unused: Vec<String> = unused.map(|info| info.describe()).collect();
        let left = match unused.is_empty() {
            true => "no tensor is left".to_owned(),
            false => format!("left are {}", unused.join(", ")),
        };
        let found = format!("{option}, but no tensor for encoder.weight or decoder.weight; {left}");
        let expected = format!("--map encoder.weight=TENSOR and so on, or no {option}");
        Err(self.tensors.refused(Place::Whole, found, expected))
    }

    /// Refuses unused tensors that by shape are a missing encoder or decoder, or by their numbers a mask.
    fn check_left_over(&self, parts: &Parts) -> Read<()> {
        let unused = self.assignment.unused.iter();
        let unused: Vec<_> = unused.filter(|info| !is_of_optimiser(&info.name)).collect();
        let refused = |found: String, expected: String| {
            Err(self.tensors.refused(Place::Whole, found, expected))
        };
        let missing = match (&parts.encoder, &parts.decoder) {
            (None, Some(other)) => Some((Part::Encoder, other)),
            (Some(other), None) => Some((Part::Decoder, other)),
            _ => None,
        };
        if let Some((part, other)) = missing {
            let (a, b) = (other.input_dim(), other.output_dim());
            let fits = |info: &&&&TensorInfo| info.shape == [a, b] || info.shape == [b, a];
            if let Some(info) = unused.iter().find(fits) {
                let (name, described) = (part.name(), info.describe());
                return refused(
                    format!("no {name}, and {described} unused, which has its shape"),
                    format!("--map {name}.weight={}, or a file without it", info.name),
                );
            }
        }
        let first = &parts.phases[0];
        let Some(mask) = unused.iter().find(|info| self.is_mask(info, &first.xi)) else {
            return Ok(());
        };
        let (phase, described, mask) = (&first.name, mask.describe(), &mask.name);
        refused(
            format!("{described} unused, zeros and ones in the shape of xi.{phase}"),
            format!(
                "--map mask.{phase}={mask} (0 switches a coefficient off), or a file without it"
            ),
        )
    }

    /// Whether a tensor has the shape of coefficients and holds zeros and ones, both of them.
    fn is_mask(&self, info: &TensorInfo, xi: &DMatrix<f64>) -> bool {
        let (terms, latent) = xi.shape();
        let &[rows, columns] = info.shape.as_slice() else {
            return false;
        };
        if ![(terms, latent), (latent, terms)].contains(&(rows, columns)) {
            return false;
        }
        let read = self.tensors.read(info, (rows, columns), |_| Place::Whole);
        read.is_ok_and(|values| {
            let has = |flag: f64| values.iter().any(|&value| value == flag);
            has(0.0) && has(1.0) && values.iter().all(|&value| value == 0.0 || value == 1.0)
        })
    }

    /// Coefficients of a phase in the file's order of terms, `library_dim x latent_dim`.
    fn xi(&mut self, phase: &str, choice: &LibraryChoice) -> Read<DMatrix<f64>> {
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
        self.note(format!(
            "the mask of phase {phase} switched {count} coefficients off"
        ));
        Ok(xi.zip_map(&mask, |value, flag| if flag == 0.0 { 0.0 } else { value }))
    }

    fn terms_by_latent(
        &mut self,
        assigned: &Assigned<'_>,
        choice: &LibraryChoice,
    ) -> Read<(DMatrix<f64>, Layout)> {
        let (by_terms, by_latent) = (Layout::TermsByLatent, Layout::LatentByTerms);
        // Each way with the numbers of terms and of latent coordinates.
        let mut ways = match assigned.info.shape[..] {
            [length] => vec![(Layout::Plain, (length, 1))],
            [rows, columns] => vec![(by_terms, (rows, columns)), (by_latent, (columns, rows))],
            _ => Vec::new(),
        };
        let excluded = match self.options.xi_layout {
            Some(XiLayout::TermsByLatent) => Some(by_latent),
            Some(XiLayout::LatentByTerms) => Some(by_terms),
            None => None,
        };
        ways.retain(|&(way, (terms, latent))| {
            Some(way) != excluded
                && latent > 0
                && self.known.latent.is_none_or(|known| known == latent)
                && library::dim(choice, latent) == Some(terms)
        });
        let option = "--xi-layout terms-by-latent (one row per term) or --xi-layout latent-by-terms \
                      (one row per latent coordinate)";
        let expected = || self.expected_xi(assigned.info.shape.len(), choice);
        let (layout, (terms, latent)) = self.only_way(assigned, &ways, expected, option)?;
        let stored = match layout {
            Layout::LatentByTerms => (latent, terms),
            _ => (terms, latent),
        };
        Ok((self.read(assigned, stored, layout)?, layout))
    }

    fn expected_xi(&self, rank: usize, choice: &LibraryChoice) -> String {
        if rank == 3 {
            return "one tensor per phase: in Python, {\"xi.contact\": Xi[0], \"xi.flight\": Xi[1]}"
                .to_owned();
        }
        let latent = self.known.latent;
        let (terms, source) = match choice {
            LibraryChoice::Terms(terms) => (
                Some(terms.len()),
                format!("a list of {} terms", terms.len()),
            ),
            LibraryChoice::Standard(standard) => {
                let count = latent.and_then(|d| standard.term_count(d));
                (count, standard_text(*standard))
            }
        };
        let latent = text_or(latent, "d");
        let terms = text_or(terms, "terms");
        format!("{terms} x {latent} or {latent} x {terms} (library: {source})")
    }

    fn no_library(&self, first: &Assigned<'_>) -> ImportError {
        let shape = &first.info.shape;
        let latent = self.known.latent.or(shape.iter().copied().min());
        let terms = match (latent, shape.as_slice()) {
            (Some(d), &[terms, columns]) if d == columns => Some(terms),
            (Some(d), &[rows, terms]) if d == rows => Some(terms),
            _ => None,
        };
        let suggestions = terms
            .zip(latent)
            .map(|(terms, d)| library::standards_with(terms, d));
        let suggested = match suggestions.filter(|texts| !texts.is_empty()) {
            Some(texts) => format!("; for this shape perhaps --library {}", texts.join(" or ")),
            None => String::new(),
        };
        let expected = format!(
            "--library degree=N[,trigonometric][,inputs] or --library FILE with the list of terms{suggested}"
        );
        let found = format!("no candidate terms for {}", first.info.describe());
        self.tensors.refused(Place::Whole, found, expected)
    }

    fn statistics(&mut self) -> Read<Vec<(String, InputStatistics)>> {
        let mut all = Vec::new();
        for rule in &self.assignment.phases {
            let roles = [Role::InputMean, Role::InputCovariance].map(|of| of(rule.name.clone()));
            let (mean, covariance) = match roles.each_ref().map(|role| self.find(role)) {
                [None, None] => continue,
                [Some(mean), Some(covariance)] => (mean, covariance),
                [mean, _] => return Err(self.tensors.missing(&roles[usize::from(mean.is_some())])),
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

fn text_or(dim: Option<usize>, letter: &str) -> String {
    dim.map_or(letter.to_owned(), |dim| dim.to_string())
}
