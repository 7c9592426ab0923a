//! From programs to source code: C, Rust, Python, CasADi, MATLAB.
//!
//! A `ModelInterface` enters: every function that is generated for a model, as a program. Text leaves. `interface`
//! lists the functions, `translate` and `arrays` turn programs into statements, `printer` prints these by the patterns
//! of a language (`dialect`, `languages`), templates place them. Nothing mathematical is decided here.

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
