//! What computes sines and cosines in generated C and Rust.

/// Where sines and cosines come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SineCosine {
    /// A kernel of romc's own inside the generated file: within about one unit of the last place,
    /// without branches, so that loops over it vectorise; the same bits on every machine.
    #[default]
    Inline,
    /// The platform's mathematics library.
    Library,
}
