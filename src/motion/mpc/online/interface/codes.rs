//! Every code that the interface returns, and the text of the last refusal.

use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

use super::super::command::Status;
use super::super::error::ControlError;

/// A pointer is null or not aligned.
pub const BAD_POINTER: i32 = -4;
/// The time of a reference does not increase.
pub const TIME_ORDER: i32 = -5;
/// No phase of the model has the feet of a reference's sample in contact.
pub const UNKNOWN_FEET: i32 = -6;
/// A setting is out of its range.
pub const BAD_SETTING: i32 = -7;
/// The conic solver refused the problem.
pub const SOLVER_REFUSED: i32 = -8;
/// The controller broke down inside; it works again after a new reference.
pub const INTERNAL: i32 = -9;

/// Runs `action`; its error or panic becomes a code, and a message for [`last_error`].
pub(super) fn guarded<T>(action: impl FnOnce() -> Result<T, ControlError>) -> Result<T, i32> {
    match catch_unwind(AssertUnwindSafe(action)) {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(error)) => {
            report(&error.to_string());
            Err(code_of(&error))
        }
        Err(_) => {
            report("the controller broke down inside");
            Err(INTERNAL)
        }
    }
}

fn code_of(error: &ControlError) -> i32 {
    match error {
        ControlError::Shape { .. } => INTERNAL,
        ControlError::Setting { .. } | ControlError::StructuredDim { .. } => BAD_SETTING,
        ControlError::ReferenceLen { .. } | ControlError::ReferenceShape { .. } => {
            Status::WrongDimension.code()
        }
        ControlError::ReferenceValue { .. } => Status::NotFinite.code(),
        ControlError::ReferenceTime { .. } => TIME_ORDER,
        ControlError::ReferencePhase { .. } => UNKNOWN_FEET,
        ControlError::Solver { .. } => SOLVER_REFUSED,
    }
}

thread_local! {
    static LAST_ERROR: RefCell<CString> = RefCell::new(CString::default());
}

/// Leaves a message for [`last_error`].
pub fn report(message: &str) {
    let text = CString::new(message.replace('\0', " ")).unwrap_or_default();
    LAST_ERROR.with_borrow_mut(|last| *last = text);
}

/// Why the last call on this thread that made a controller or set a reference was refused; valid
/// until the next such call on this thread.
pub fn last_error() -> *const c_char {
    LAST_ERROR.with_borrow(|last| last.as_ptr())
}

/// The codes beside those of [`Status`], in words.
const BEYOND_STEPS: [(i32, &CStr); 6] = [
    (BAD_POINTER, c"bad pointer: null or not aligned; fallback"),
    (
        TIME_ORDER,
        c"time order: the reference's time does not increase",
    ),
    (
        UNKNOWN_FEET,
        c"unknown feet: no phase of the model has these feet in contact",
    ),
    (BAD_SETTING, c"bad setting: a setting is out of its range"),
    (
        SOLVER_REFUSED,
        c"solver refused: the conic solver does not take the problem",
    ),
    (
        INTERNAL,
        c"internal: the controller broke down; set a reference to use it again",
    ),
];

/// Every code that the interface returns, with its text.
pub fn all_codes() -> impl Iterator<Item = (i32, &'static CStr)> {
    let of_steps = Status::ALL.map(|status| (status.code(), step_text(status)));
    of_steps.into_iter().chain(BEYOND_STEPS)
}

/// A status or return code in words.
pub fn status_text(code: i32) -> &'static CStr {
    let mut codes = all_codes();
    let found = codes.find(|(known, _)| *known == code);
    found.map_or(c"unknown status", |(_, text)| text)
}

fn step_text(status: Status) -> &'static CStr {
    match status {
        Status::Solved => c"solved: a plan whose optimality conditions were checked",
        Status::Softened => c"softened: a checked plan that leaves the joint limits somewhere",
        Status::ContactEarly => c"contact early: a checked plan, the feet are in the reference's next phase",
        Status::ContactLate => c"contact late: a checked plan, the feet are in the reference's last phase",
        Status::ContactUnknown => c"contact unknown: a checked plan, the feet are in no phase of the model or in one far from the reference",
        Status::Inaccurate => c"inaccurate: the solver's point fails the optimality conditions; fallback",
        Status::Infeasible => c"infeasible: the constraints contradict each other; fallback",
        Status::IterationCap => c"iteration cap: the solver reached its deadline; fallback",
        Status::NumericalFailure => c"numerical failure: the solver broke down; fallback",
        Status::MeasurementJump => c"measurement jump: a measurement far from the prediction; fallback",
        Status::LiftFailed => c"lift failed: no torques for the latent input; fallback",
        Status::NotFinite => c"not finite: a number is infinite or not a number; fallback",
        Status::WrongDimension => c"wrong dimension: the wrong number of values or too few samples; fallback",
        Status::NoReference => c"no reference: none has been set; fallback",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_has_a_text_and_that_of_a_status_begins_with_its_word() {
        let mut known: Vec<i32> = all_codes().map(|(code, _)| code).collect();
        let count = known.len();
        known.sort_unstable();
        known.dedup();
        assert_eq!(known.len(), count);
        for status in Status::ALL {
            let text = status_text(status.code()).to_string_lossy();
            let word = status.word().replace('_', " ");
            assert!(text.starts_with(&format!("{word}:")), "{text}");
        }
        assert_eq!(status_text(77), c"unknown status");
    }
}
