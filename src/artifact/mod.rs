//! The model file `romc-model/1`.
