//! From a model to programs and equations.
