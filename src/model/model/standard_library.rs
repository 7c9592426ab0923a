//! The standard library of candidate terms, in the order of the published arrays.

use clap::ValueEnum;
use clap::builder::PossibleValue;

use super::library::check_term_count;
use super::*;

pub(crate) const MAX_DEGREE: u32 = 8;

/// Groups of terms in this order: constant; z; dz; monomials of degree 2 to `degree` over `(z, dz)`; sin z; sin dz; cos
/// z; cos dz; u. Monomials are graded, each with indices `i <= j <= k`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StandardLibrary {
    /// Highest degree of the monomials: 0 is the constant alone, 1 adds z and dz.
    pub degree: u32,
    pub trigonometric: bool,
    pub inputs: bool,
}

impl Default for StandardLibrary {
    /// The library of the paper's equations: degree 1, sines and cosines, inputs.
    fn default() -> Self {
        Self {
            degree: 1,
            trigonometric: true,
            inputs: true,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Group {
    Constant,
    Linear,
    Higher,
    Trigonometric,
    Inputs,
}

/// How many states share a run of sines, which the run of their cosines follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Run {
    All,
    Half,
    Single,
}

impl Run {
    fn len(self, latent_dim: usize) -> usize {
        match self {
            Run::All => 2 * latent_dim,
            Run::Half => latent_dim,
            Run::Single => 1,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LibraryOrder {
    groups: [Group; 5],
    run: Run,
    functions: [&'static str; 2],
    /// `z1, dz1, z2, dz2` in place of `z1, z2, dz1, dz2`.
    is_paired: bool,
}

impl LibraryOrder {
    /// That of [`StandardLibrary`]: sin z, sin dz, cos z, cos dz.
    pub const ROMC: Self = Self {
        groups: [
            Group::Constant,
            Group::Linear,
            Group::Higher,
            Group::Trigonometric,
            Group::Inputs,
        ],
        run: Run::All,
        functions: ["sin", "cos"],
        is_paired: false,
    };
    /// Appendix B of the paper: sin z, cos z, sin dz, cos dz.
    pub(crate) const PAPER: Self = Self {
        run: Run::Half,
        ..Self::ROMC
    };
    /// sin z1, cos z1, sin z2, ..., then dz likewise, as in PySINDy's `FourierLibrary`.
    pub(crate) const INTERLEAVED: Self = Self {
        run: Run::Single,
        ..Self::ROMC
    };
    pub const NAMED: [Self; 3] = [Self::PAPER, Self::INTERLEAVED, Self::ROMC];

    const NAMES: [(&str, &str); 3] = [
        (
            "paper",
            "sin z, cos z, sin dz, cos dz: Appendix B of the paper",
        ),
        (
            "interleaved",
            "sin z1, cos z1, sin z2, ..., then dz: the paper's training code, PySINDy",
        ),
        ("romc", "sin z, sin dz, cos z, cos dz: model files of romc"),
    ];

    fn named(&self) -> Option<(&'static str, &'static str)> {
        let place = Self::NAMED.iter().position(|named| named == self)?;
        Some(Self::NAMES[place])
    }

    pub fn name(&self) -> Option<&'static str> {
        self.named().map(|(name, _)| name)
    }

    /// Those with names, then those with groups elsewhere, cosines first, or each z followed by its dz.
    pub fn common() -> Vec<Self> {
        use Group::{Constant, Higher, Inputs, Linear, Trigonometric};
        let middle = [
            [Linear, Higher, Trigonometric, Inputs],
            [Linear, Higher, Inputs, Trigonometric],
            [Linear, Inputs, Higher, Trigonometric],
            [Inputs, Linear, Higher, Trigonometric],
            [Trigonometric, Linear, Higher, Inputs],
            [Inputs, Trigonometric, Linear, Higher],
            [Trigonometric, Inputs, Linear, Higher],
        ];
        let mut orders = Self::NAMED.to_vec();
        for [a, b, c, d] in middle {
            let places = [
                [Constant, a, b, c, d],
                [a, b, c, d, Constant],
                [a, Constant, b, c, d],
            ];
            // The constant is between other groups only where these are not the variables.
            for groups in &places[..if a == Linear { 2 } else { 3 }] {
                for run in [Run::Half, Run::Single, Run::All] {
                    for functions in [["sin", "cos"], ["cos", "sin"]] {
                        orders.extend([false, true].map(|is_paired| Self {
                            groups: *groups,
                            run,
                            functions,
                            is_paired,
                        }));
                    }
                }
            }
        }
        orders
    }
}

impl ValueEnum for LibraryOrder {
    fn value_variants<'a>() -> &'a [Self] {
        &Self::NAMED
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let (name, help) = self.named()?;
        Some(PossibleValue::new(name).help(help))
    }
}

impl StandardLibrary {
    /// Number of terms for `latent_dim`, without making them; `None` beyond `usize`.
    pub fn term_count(&self, latent_dim: usize) -> Option<usize> {
        // Monomials of degree up to p over v variables: C(v + p, p).
        let variables = latent_dim.checked_mul(2)?;
        let mut count: usize = 1;
        for k in 1..=self.degree as usize {
            count = count.checked_mul(variables.checked_add(k)?)? / k;
        }
        if self.trigonometric {
            count = count.checked_add(variables.checked_mul(2)?)?;
        }
        if self.inputs {
            count = count.checked_add(latent_dim)?;
        }
        Some(count)
    }

    pub fn small() -> impl Iterator<Item = Self> {
        (0..=3).flat_map(|degree| {
            let more = [(true, true), (true, false), (false, true), (false, false)];
            more.map(|(trigonometric, inputs)| Self {
                degree,
                trigonometric,
                inputs,
            })
        })
    }

    pub(super) fn texts(&self, latent_dim: usize) -> Result<Vec<String>> {
        self.texts_in(LibraryOrder::ROMC, latent_dim)
    }

    pub fn texts_in(&self, order: LibraryOrder, latent_dim: usize) -> Result<Vec<String>> {
        let expected = format!("at most {MAX_DEGREE}");
        let fits = self.degree <= MAX_DEGREE;
        check(fits, "`library.degree`", || self.degree, expected)?;
        let count = self.term_count(latent_dim).unwrap_or(usize::MAX);
        check_term_count(count)?;
        let name = |kind: &'static str| (1..=latent_dim).map(move |i| format!("{kind}{i}"));
        let names: Vec<String> = name("z").chain(name("dz")).collect();
        let state: Vec<usize> = match order.is_paired {
            false => (0..2 * latent_dim).collect(),
            true => (0..latent_dim).flat_map(|i| [i, latent_dim + i]).collect(),
        };
        let mut texts = Vec::with_capacity(count);
        for group in order.groups {
            match group {
                Group::Constant => texts.push("1".to_owned()),
                Group::Linear => texts.extend(monomials(&names, &state, 1..=self.degree.min(1))),
                Group::Higher => texts.extend(monomials(&names, &state, 2..=self.degree)),
                Group::Trigonometric if self.trigonometric => {
                    for run in state.chunks(order.run.len(latent_dim)) {
                        for function in order.functions {
                            texts.extend(run.iter().map(|&i| format!("{function}({})", names[i])));
                        }
                    }
                }
                Group::Inputs if self.inputs => texts.extend(name("u")),
                Group::Trigonometric | Group::Inputs => {}
            }
        }
        Ok(texts)
    }

    pub fn rows_in(&self, order: LibraryOrder, latent_dim: usize) -> Result<Vec<usize>> {
        let own = self.texts(latent_dim)?;
        let rows: HashMap<&str, usize> = (own.iter().map(String::as_str)).zip(0..).collect();
        let texts = self.texts_in(order, latent_dim)?;
        Ok(texts.iter().map(|text| rows[text.as_str()]).collect())
    }
}

/// Monomials of some degrees over the names in an order of the state, graded.
fn monomials(names: &[String], state: &[usize], degrees: RangeInclusive<u32>) -> Vec<String> {
    let mut texts = Vec::new();
    // The monomials of one degree by their places in the order; with one more, none before the last.
    let mut monomials: Vec<Vec<usize>> = vec![Vec::new()];
    for degree in 1..=*degrees.end() {
        let longer = monomials.iter().flat_map(|factors| {
            let last = factors.last().copied().unwrap_or(0);
            (last..state.len()).map(move |next| [&factors[..], &[next]].concat())
        });
        monomials = longer.collect();
        if degrees.contains(&degree) {
            texts.extend(monomials.iter().map(|places| {
                let mut factors: Vec<usize> = places.iter().map(|&place| state[place]).collect();
                factors.sort_unstable();
                monomial_text(names, &factors)
            }));
        }
    }
    texts
}

fn monomial_text(names: &[String], factors: &[usize]) -> String {
    let powers: Vec<String> = (factors.chunk_by(|a, b| a == b))
        .map(|run| match run.len() {
            1 => names[run[0]].clone(),
            exponent => format!("{}^{exponent}", names[run[0]]),
        })
        .collect();
    powers.join("*")
}
