//! What computes sines and cosines in generated C and Rust.

/// Where sines and cosines come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum SineCosine {
    // Within about one unit of the last place, without branches, so that loops over it vectorise.
    /// A function inside the file that compilers vectorise, the same bits everywhere.
    #[default]
    Inline,
    /// The platform's mathematics library.
    Library,
}
