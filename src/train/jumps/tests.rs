//! Tests of landmarks, prior and deviations on the shipped recordings.
