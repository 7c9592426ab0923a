//! Learning a model from recordings.
