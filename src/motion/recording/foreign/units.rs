//! Units of other logs and their factors to SI.

/// What a unit measures; rates and accelerations are the same per s and s^2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Dimension {
    Angle,
    Length,
    Torque,
    Force,
    Time,
}

impl Dimension {
    /// Units with their factors to rad, m, N m, N or s.
    pub(crate) const fn units(self) -> &'static [(&'static str, f64)] {
        const DEGREE: f64 = std::f64::consts::PI / 180.0;
        const TURN: f64 = 2.0 * std::f64::consts::PI;
        match self {
            Dimension::Angle => &[
                ("rad", 1.0),
                ("deg", DEGREE),
                ("mrad", 1e-3),
                ("turn", TURN),
                ("rpm", TURN / 60.0),
                ("degree", DEGREE),
                ("degrees", DEGREE),
                ("radians", 1.0),
                ("°", DEGREE),
            ],
            Dimension::Length => &[("m", 1.0), ("mm", 1e-3), ("cm", 1e-2)],
            Dimension::Torque => &[("nm", 1.0), ("nmm", 1e-3), ("mnm", 1e-3), ("ncm", 1e-2)],
            Dimension::Force => &[("n", 1.0), ("kn", 1e3), ("kgf", 9.80665)],
            Dimension::Time => &[
                ("s", 1.0),
                ("ms", 1e-3),
                ("us", 1e-6),
                ("µs", 1e-6),
                ("ns", 1e-9),
                ("min", 60.0),
                ("iso", 1.0),
            ],
        }
    }

    /// The factor of a unit such as `deg/s`, `mm`, `N mm`; case, blanks and `/s` do not matter.
    pub(crate) fn factor(self, text: &str) -> Option<f64> {
        let folded: String = (text.chars())
            .filter(|c| !c.is_whitespace() && !matches!(c, '*' | '.' | '·'))
            .flat_map(char::to_lowercase)
            .collect();
        let base = match self {
            Dimension::Time => &folded[..],
            _ => folded.split('/').next().unwrap_or_default(),
        };
        let known = self.units().iter().find(|(name, _)| *name == base);
        known.map(|(_, factor)| *factor)
    }

    pub(crate) fn names(self) -> String {
        let names: Vec<&str> = self.units().iter().map(|(name, _)| *name).collect();
        names.join(", ")
    }
}
