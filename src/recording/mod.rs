//! Recorded jumps: reading, checking, preprocessing.
