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

use std::collections::{HashMap, HashSet};

use askama::Template;
use dialect::{Dialect, Function, Index, Parameter, Role, Span, comment_lines};
use ident::{Ident, Namer, Tables};
use interface::{FunctionSpec, ModelInterface, computes_angles};
use model_text::{KernelText, ModelText};
use printer::Text;
use test_vectors::{FunctionVectors, N_BATCH, N_POINTS, ParameterVectors};

use crate::equations::{Equations, LatentUnits, Unit, summand_words};
use crate::files::EmittedFile;
use crate::ir::{
    Binary, FUNCTIONS, Interpreter, LANES, Program, Slot, Statement, Table, Unary, ValueId, Vector,
    alternating,
};
use crate::lower::{Form, JacobianPattern, LowerError, Map};
use crate::model::{CoordinateNames, ModelError, ReducedModel, Scaling};

type Result<T, E = CodegenError> = std::result::Result<T, E>;
