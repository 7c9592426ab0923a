//! From programs to source code: C, Rust, Python, CasADi, MATLAB. Nothing mathematical is decided here.
//!
//! `interface` lists the functions of a model as programs, `translate` and `arrays` turn them into statements,
//! `printer` prints these by the patterns of a language (`dialect`, `script`), templates place them.

mod arrays;
#[doc(hidden)] // for `deploy`, in the crate above
pub mod c;
mod dialect;
mod documentation;
mod ident;
#[doc(hidden)] // for `deploy`, in the crate above
pub mod interface;
mod model_text;
mod options;
mod printer;
#[doc(hidden)] // for `deploy`, in the crate above
pub mod rust;
#[doc(hidden)] // for `deploy`, in the crate above
pub mod script;
mod test_vectors;
mod translate;

#[doc(hidden)] // for `deploy`, in the crate above
pub use dialect::{tidy, wrapped};
pub use options::{CodegenError, Precision, SineCosine, Units};
