//! The text of these sources: every generated controller holds them.

/// Path and text of files, by their folders.
macro_rules! sources {
    ($($folder:literal: $($file:ident)*;)*) => {
        &[$($((
            concat!($folder, "/", stringify!($file), ".rs"),
            include_str!(concat!($folder, "/", stringify!($file), ".rs")),
        )),*),*]
    };
}

/// Path below this crate, which is that below `src` of a generated one, and text of each file.
pub const SOURCES: &[(&str, &str)] = sources! {
    "online":
        choices command conic contacts control_model controller dense effectiveness error estimate horizon
        interface lift lift_program linearise machine mod plan problem qp reference routine settings stage step
        structured supervisor trajectory walk walker;
    "solver":
        interior links lower mod point problem riccati rows scalar solve;
};
