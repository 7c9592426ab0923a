//! Integration of the hybrid model.
