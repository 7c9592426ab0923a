//! Jumps divided into sets for training, validation and test.

use std::fmt;
use std::str::FromStr;

use super::error::TrainError;
use super::random::Random;

/// Shares of the jumps for training, validation and test, such as 14, 3 and 3: any unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Split {
    shares: [usize; 3],
}

impl FromStr for Split {
    type Err = String;

    /// Two or three whole numbers separated by commas; the first is not 0.
    fn from_str(text: &str) -> Result<Self, String> {
        let refused = || {
            format!(
                "found `{text}`, expected shares for training, validation and test such as 14,3,3"
            )
        };
        let numbers = text.split(',').map(|number| number.trim().parse::<usize>());
        let numbers: Vec<usize> = numbers.collect::<Result<_, _>>().map_err(|_| refused())?;
        let shares = match numbers[..] {
            [training, validation] => [training, validation, 0],
            [training, validation, test] => [training, validation, test],
            _ => return Err(refused()),
        };
        if shares[0] == 0 || shares.iter().any(|share| *share > 1_000_000) {
            return Err(refused());
        }
        Ok(Self { shares })
    }
}

impl fmt::Display for Split {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [training, validation, test] = self.shares;
        write!(f, "{training},{validation},{test}")
    }
}

impl Split {
    /// Draws the sets: for training, validation and test the numbers of its jumps, rising. A jump (a segment of a
    /// recording) goes into one of them as a whole, by a random order that depends on nothing but `seed` and the number
    /// of jumps.
    ///
    /// # Errors
    /// [`TrainError::Split`] if there are fewer jumps than sets.
    pub fn of(&self, jumps: usize, seed: u64) -> Result<[Vec<usize>; 3], TrainError> {
        let counts = self.counts(jumps)?;
        let order = shuffled(jumps, seed);
        let (training, rest) = order.split_at(counts[0]);
        let (validation, test) = rest.split_at(counts[1]);
        Ok([training, validation, test].map(|set| {
            let mut set = set.to_vec();
            set.sort_unstable();
            set
        }))
    }

    /// Jumps a set: in proportion, the largest remainders rounded up, at least one where the share is not 0.
    fn counts(&self, jumps: usize) -> Result<[usize; 3], TrainError> {
        let wanted = self.shares.iter().filter(|share| **share > 0).count();
        if jumps < wanted {
            return Err(TrainError::Split {
                found: jumps,
                expected: wanted,
            });
        }
        let total: usize = self.shares.iter().sum();
        let mut counts = self.shares.map(|share| match share {
            0 => 0,
            share => (share * jumps / total).max(1),
        });
        let owed = |counts: &[usize; 3], set: usize| {
            (self.shares[set] * jumps) as i64 - (counts[set] * total) as i64
        };
        while counts.iter().sum::<usize>() != jumps {
            let given: usize = counts.iter().sum();
            let sets = (0..3).filter(|set| self.shares[*set] > 0);
            // `max_by_key` takes the last of equals: reversed, training comes first.
            if given < jumps {
                let next = sets.rev().max_by_key(|set| owed(&counts, *set));
                counts[next.expect("invariant: a share is not 0")] += 1;
            } else {
                let next = sets
                    .filter(|set| counts[*set] > 1)
                    .min_by_key(|set| owed(&counts, *set));
                counts[next.expect("invariant: more jumps than sets")] -= 1;
            }
        }
        Ok(counts)
    }
}

/// The numbers below `count` in a random order (Fisher and Yates).
fn shuffled(count: usize, seed: u64) -> Vec<usize> {
    let mut random = Random::new(seed);
    let mut order: Vec<usize> = (0..count).collect();
    for last in (1..count).rev() {
        order.swap(last, random.below(last + 1));
    }
    order
}
