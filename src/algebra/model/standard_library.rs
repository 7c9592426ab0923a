//! The standard library of candidate terms, in the order of the published arrays.

use serde::{Deserialize, Serialize};

use super::error::LibraryError;
use super::library::MAX_LIBRARY_DIM;

/// Largest polynomial degree of the standard library.
pub const MAX_DEGREE: u32 = 8;

/// The shorthand of the model file: which groups of terms a library has.
///
/// Order: constant; z; dz; monomials of degree 2 to `degree` over `(z, dz)`, graded, each with
/// indices `i <= j <= k`; sin z; sin dz; cos z; cos dz; u.
///
/// ```
/// use romc::model::{Library, StandardLibrary};
///
/// let library = Library::standard(1, StandardLibrary { degree: 2, trigonometric: false, inputs: true })?;
/// let texts: Vec<&str> = library.terms().iter().map(|term| term.text()).collect();
/// assert_eq!(texts, ["1", "z1", "dz1", "z1^2", "z1*dz1", "dz1^2", "u1"]);
/// # Ok::<(), romc::model::LibraryError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StandardLibrary {
    /// Highest degree of the monomials: 0 is the constant alone, 1 adds z and dz.
    pub degree: u32,
    /// Sines and cosines of each z and dz.
    pub trigonometric: bool,
    /// The latent inputs.
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

    /// The terms in the syntax of the model file.
    pub(super) fn texts(&self, latent_dim: usize) -> Result<Vec<String>, LibraryError> {
        if self.degree > MAX_DEGREE {
            return Err(LibraryError::Degree { found: self.degree });
        }
        let count = self.term_count(latent_dim).unwrap_or(usize::MAX);
        if count > MAX_LIBRARY_DIM {
            return Err(LibraryError::TooManyTerms { found: count });
        }
        let z = || (1..=latent_dim).map(|i| format!("z{i}"));
        let dz = || (1..=latent_dim).map(|i| format!("dz{i}"));
        let state: Vec<String> = z().chain(dz()).collect();
        let mut texts = vec!["1".to_owned()];
        // The monomials of one degree by their factors; with one more, none before the last.
        let mut monomials: Vec<Vec<usize>> = vec![Vec::new()];
        for _ in 0..self.degree {
            let longer = monomials.iter().flat_map(|factors| {
                let last = factors.last().copied().unwrap_or(0);
                (last..state.len()).map(move |next| [&factors[..], &[next]].concat())
            });
            monomials = longer.collect();
            texts.extend(
                monomials
                    .iter()
                    .map(|factors| monomial_text(&state, factors)),
            );
        }
        if self.trigonometric {
            for function in ["sin", "cos"] {
                texts.extend(state.iter().map(|name| format!("{function}({name})")));
            }
        }
        if self.inputs {
            texts.extend((1..=latent_dim).map(|i| format!("u{i}")));
        }
        Ok(texts)
    }
}

fn monomial_text(names: &[String], factors: &[usize]) -> String {
    let powers: Vec<String> = factors
        .chunk_by(|a, b| a == b)
        .map(|run| match run.len() {
            1 => names[run[0]].clone(),
            exponent => format!("{}^{exponent}", names[run[0]]),
        })
        .collect();
    powers.join("*")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn standard_library_follows_the_published_order_with_indices_that_do_not_fall() {
        let degree_two = "1 z1 z2 dz1 dz2 \
            z1^2 z1*z2 z1*dz1 z1*dz2 z2^2 z2*dz1 z2*dz2 dz1^2 dz1*dz2 dz2^2 \
            sin(z1) sin(z2) sin(dz1) sin(dz2) cos(z1) cos(z2) cos(dz1) cos(dz2) u1 u2";
        let degree_three = "1 z1 dz1 z1^2 z1*dz1 dz1^2 z1^3 z1^2*dz1 z1*dz1^2 dz1^3";
        for (latent_dim, degree, has_more, expected) in
            [(2, 2, true, degree_two), (1, 3, false, degree_three)]
        {
            let standard = StandardLibrary {
                degree,
                trigonometric: has_more,
                inputs: has_more,
            };
            assert_eq!(standard.texts(latent_dim).unwrap().join(" "), expected);
        }
    }

    #[test]
    fn standard_library_count_agrees_with_terms_made() {
        for latent_dim in 1..=5 {
            for degree in 0..=4 {
                for (trigonometric, inputs) in [(false, true), (true, false), (true, true)] {
                    let standard = StandardLibrary {
                        degree,
                        trigonometric,
                        inputs,
                    };
                    assert_eq!(
                        standard.term_count(latent_dim),
                        Some(standard.texts(latent_dim).unwrap().len())
                    );
                }
            }
        }
    }

    #[test]
    fn standard_library_of_published_degree_has_seven_d_plus_one_terms() {
        let count = |latent_dim| StandardLibrary::default().term_count(latent_dim);
        assert!((1..=18).all(|latent_dim| count(latent_dim) == Some(7 * latent_dim + 1)));
    }
}
