//! Tests on the shipped recordings.
