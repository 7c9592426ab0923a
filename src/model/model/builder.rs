//! The checked constructor of [`ReducedModel`].

use super::identifier::identifier_of;
use super::maps::pinv_of_transpose;
use super::*;

const MAX_PHASES: usize = 16;
const MAX_STATE_DIM: usize = 256;
const MAX_DESCRIPTION_LEN: usize = 10_000;
const MAX_SAMPLE_TIME_S: f64 = 1.0;

/// A method for each part that replaces it; the model's method of that name documents it.
macro_rules! setters {
    ($($part:ident: $value:ty;)*) => {
        $(pub fn $part(mut self, $part: $value) -> Self {
            self.$part = $part.into();
            self
        })*
    };
}

/// Collects the parts of a model; [`ModelBuilder::build`] checks them against each other.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelBuilder {
    pub(crate) name: String,
    pub(crate) description: String,
    pub(crate) library: Library,
    pub(crate) phases: Vec<Phase>,
    pub(crate) statistics: Vec<(String, InputStatistics)>,
    pub(crate) state: Option<CoordinateNames>,
    pub(crate) input: Option<CoordinateNames>,
    pub(crate) scaling: Option<Scaling>,
    pub(crate) encoder: Option<StateMap>,
    pub(crate) decoder: Option<StateMap>,
    pub(crate) robot: Option<&'static Robot>,
    pub(crate) actuators: Option<Actuators>,
    pub(crate) wrench_frame: WrenchFrame,
    pub(crate) jump_prior: Option<JumpPrior>,
    pub(crate) stride_prior: Option<StridePrior>,
    pub(crate) sample_time_s: Option<f64>,
    pub(crate) provenance: Map<String, Value>,
}

impl ModelBuilder {
    pub(super) fn new(name: String, library: Library) -> Self {
        Self {
            name,
            description: String::new(),
            library,
            phases: Vec::new(),
            statistics: Vec::new(),
            state: None,
            input: None,
            scaling: None,
            encoder: None,
            decoder: None,
            robot: None,
            actuators: None,
            wrench_frame: WrenchFrame::Body,
            jump_prior: None,
            stride_prior: None,
            sample_time_s: None,
            provenance: Map::new(),
        }
    }

    setters! {
        name: impl Into<String>;
        description: impl Into<String>;
        library: Library;
        phases: Vec<Phase>;
        state: impl Into<Option<CoordinateNames>>;
        input: impl Into<Option<CoordinateNames>>;
        scaling: impl Into<Option<Scaling>>;
        encoder: impl Into<Option<StateMap>>;
        decoder: impl Into<Option<StateMap>>;
        robot: impl Into<Option<&'static Robot>>;
        actuators: Option<Actuators>;
        wrench_frame: WrenchFrame;
        jump_prior: Option<JumpPrior>;
        stride_prior: Option<StridePrior>;
        sample_time_s: impl Into<Option<f64>>;
        provenance: Map<String, Value>;
    }

    pub fn phase(mut self, phase: Phase) -> Self {
        self.phases.push(phase);
        self
    }

    pub fn input_statistics(mut self, phase: impl Into<String>, known: InputStatistics) -> Self {
        self.statistics.push((phase.into(), known));
        self
    }

    pub fn all_input_statistics(mut self, statistics: Vec<(String, InputStatistics)>) -> Self {
        self.statistics = statistics;
        self
    }

    pub fn build(mut self) -> Result<ReducedModel> {
        let identifier = identifier_of("model name", &self.name)?;
        let phase_identifiers = self.check_phase_names()?;
        self.check_phases()?;
        self.check_texts()?;
        let state_dim = self.check_maps()?;
        self.check_signals(state_dim)?;
        self.check_input_rule()?;
        if let Some(scaling) = &self.scaling {
            scaling.state.check("state", state_dim)?;
            scaling.input.check("input", state_dim)?;
        }
        let linear = self.encoder.as_ref().and_then(StateMap::as_affine);
        let projection = |map: &AffineMap| pinv_of_transpose(map.weights(), "`encoder.weights`");
        let input_projection = linear.map(projection).transpose()?;
        self.check_statistics(state_dim)?;
        if let Some(prior) = &self.jump_prior {
            self.check_prior(prior)?;
        }
        if let Some(prior) = &self.stride_prior {
            prior.check()?;
        }
        Ok(ReducedModel {
            parts: self,
            identifier,
            phase_identifiers,
            input_projection,
        })
    }

    fn check_phase_names(&self) -> Result<Vec<Identifier>> {
        check_count("`phases`", self.phases.len(), "phases", 1..=MAX_PHASES)?;
        let mut first_use = HashMap::new();
        let mut identifiers = Vec::new();
        for (second, phase) in self.phases.iter().enumerate() {
            let place = format!("phases[{second}].name");
            let identifier = identifier_of(&place, &phase.name)?;
            if let Some(first) = first_use.insert(identifier.upper(), second) {
                // Identifiers are compared without case, because macros are upper case.
                let found = format!("{:?}, which becomes `{identifier}` in code", phase.name);
                let expected = format!("another identifier than that of phases[{first}]");
                return Err(ModelError::invalid(place, found, expected));
            }
            identifiers.push(identifier);
        }
        Ok(identifiers)
    }

    fn check_phases(&self) -> Result<()> {
        let expected = (self.library.terms().len(), self.library.latent_dim());
        for (index, phase) in self.phases.iter().enumerate() {
            check_tensor(&format!("phases[{index}].xi"), &phase.xi, expected)?;
            if let FeetRule::Patterns(patterns) = &phase.feet {
                let mut places = 1..patterns.len();
                if let Some(again) = places.find(|&k| patterns[..k].contains(&patterns[k])) {
                    let place = format!("phases[{index}].feet[{again}]");
                    let found = "a pattern that is in the list already";
                    return Err(ModelError::invalid(place, found, "each pattern once"));
                }
            }
        }
        for (index, phase) in self.phases.iter().enumerate() {
            if !FeetRule::all_patterns().any(|feet| selected(&self.phases, feet) == Some(index)) {
                return Err(ModelError::UnreachablePhase {
                    phase: index,
                    name: phase.name.clone(),
                });
            }
        }
        Ok(())
    }

    fn check_texts(&self) -> Result<()> {
        let text = &self.description;
        let printable = |c: char| !c.is_control() || c == '\n';
        let fits = text.len() <= MAX_DESCRIPTION_LEN && text.chars().all(printable);
        let found = || format!("{} bytes or a control character", text.len());
        let expected = format!("at most {MAX_DESCRIPTION_LEN} bytes of text");
        check(fits, "`description`", found, expected)?;
        let time_s = self.sample_time_s.unwrap_or(MAX_SAMPLE_TIME_S);
        let fits = time_s > 0.0 && time_s <= MAX_SAMPLE_TIME_S;
        let expected = format!("a positive number up to {MAX_SAMPLE_TIME_S}");
        check(fits, "`sample_time_s`", || time_s, expected)
    }

    pub(super) fn state_dim(&self) -> Option<usize> {
        let named = |signals: &Option<CoordinateNames>| signals.as_ref().map(CoordinateNames::dim);
        named(&self.state)
            .or(named(&self.input))
            .or(self.encoder.as_ref().map(StateMap::input_dim))
            .or(self.decoder.as_ref().map(StateMap::output_dim))
    }

    /// Checks shapes of encoder and decoder; returns the number of robot coordinates if known.
    fn check_maps(&self) -> Result<Option<usize>> {
        let (latent_dim, needs) = (self.library.latent_dim(), "scaling");
        for (part, map) in [("encoder", &self.encoder), ("decoder", &self.decoder)] {
            map.as_ref().map_or(Ok(()), |map| map.check_chain(part))?;
            if map.is_some() && self.scaling.is_none() {
                return Err(ModelError::Incomplete { part, needs });
            }
        }
        let of_robot = self.robot.map(|_| STATE_DIM);
        let Some(dim) = of_robot.or(self.state_dim()) else {
            return Ok(None);
        };
        let fits = (latent_dim..=MAX_STATE_DIM).contains(&dim);
        let found = || format!("{dim} robot coordinates");
        let expected = format!("{latent_dim} (one per latent coordinate) to {MAX_STATE_DIM}");
        check(fits, "`state`", found, expected)?;
        if let Some(encoder) = &self.encoder {
            encoder.check("encoder", (latent_dim, dim))?;
            encoder.check_widths(latent_dim)?;
        }
        if let Some(decoder) = &self.decoder {
            decoder.check("decoder", (dim, latent_dim))?;
        }
        Ok(Some(dim))
    }

    fn check_signals(&self, state_dim: Option<usize>) -> Result<()> {
        for (signals, names, of_robot) in [
            ("state", &self.state, Robot::state_names()),
            ("input", &self.input, Robot::input_names()),
        ] {
            if let Some(names) = names {
                let robot = self.robot.map(|robot| (&of_robot[..], robot));
                names.check(signals, state_dim, robot)?;
            }
        }
        Ok(())
    }

    fn check_input_rule(&self) -> Result<()> {
        let part = match (&self.actuators, self.wrench_frame) {
            (Some(_), _) => "actuators",
            (None, WrenchFrame::World | WrenchFrame::Ground) => "wrench_frame",
            (None, WrenchFrame::Body) => return Ok(()),
        };
        if self.robot.is_none() {
            let needs = "robot";
            return Err(ModelError::Incomplete { part, needs });
        }
        let legs = self.actuators.as_ref().and_then(|known| known.legs);
        if let Some((name, found)) = legs.and_then(|legs| legs.unusable()) {
            let place = format!("`actuators.legs.{name}`");
            return Err(ModelError::invalid(place, found, LegMoments::ACCEPTED));
        }
        match self.actuators.as_ref().and_then(Actuators::unusable) {
            None => Ok(()),
            Some((array, joint, found)) => {
                let place = format!("`actuators.{array}`[{joint}], joint {}", JOINT_NAMES[joint]);
                Err(ModelError::invalid(place, found, "a number of at least 0"))
            }
        }
    }

    fn check_prior(&self, prior: &JumpPrior) -> Result<()> {
        let linear = |map: &Option<StateMap>| map.as_ref().is_some_and(|m| m.as_affine().is_some());
        let needs = match () {
            () if self.robot.is_none() => "robot",
            () if !linear(&self.encoder) => "a linear encoder",
            () if !linear(&self.decoder) => "a linear decoder",
            () => return prior.check(self.library.latent_dim(), &self.phases),
        };
        let part = "prior";
        Err(ModelError::Incomplete { part, needs })
    }

    fn check_statistics(&mut self, state_dim: Option<usize>) -> Result<()> {
        let place_of = |name: &str| self.phases.iter().position(|phase| phase.name == name);
        for (index, (name, statistics)) in self.statistics.iter().enumerate() {
            let mut earlier = self.statistics[..index].iter();
            let fits = place_of(name).is_some() && !earlier.any(|(first, _)| first == name);
            let (found, expected) = (|| format!("{name:?}"), "the name of one phase, each once");
            check(fits, "`input_statistics`", found, expected)?;
            let dim = state_dim.ok_or(ModelError::Incomplete {
                part: "input_statistics",
                needs: "encoder",
            })?;
            statistics.check(name, dim, self.library.latent_dim())?;
        }
        self.statistics.sort_by_key(|(name, _)| place_of(name));
        Ok(())
    }
}
