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

/// Every code that the interface returns.
pub fn all_codes() -> impl Iterator<Item = i32> {
    let beyond_steps = [
        BAD_POINTER,
        TIME_ORDER,
        UNKNOWN_FEET,
        BAD_SETTING,
        SOLVER_REFUSED,
        INTERNAL,
    ];
    Status::ALL
        .into_iter()
        .map(Status::code)
        .chain(beyond_steps)
}

/// A status or return code in words.
pub fn status_text(code: i32) -> &'static CStr {
    match code {
        0 => c"solved: a plan whose optimality conditions were checked",
        1 => c"softened: a checked plan that leaves the joint limits somewhere",
        2 => c"contact early: a checked plan, the feet are in the reference's next phase",
        3 => c"contact late: a checked plan, the feet are in the reference's last phase",
        4 => c"contact unknown: a checked plan, the feet are in no phase of the model or in one far from the reference",
        10 => c"inaccurate: the solver's point fails the optimality conditions; fallback",
        11 => c"infeasible: the constraints contradict each other; fallback",
        12 => c"iteration cap: the solver reached its deadline; fallback",
        13 => c"numerical failure: the solver broke down; fallback",
        14 => c"measurement jump: a measurement far from the prediction; fallback",
        15 => c"lift failed: no torques for the latent input; fallback",
        -1 => c"not finite: a number is infinite or not a number; fallback",
        -2 => c"wrong dimension: the wrong number of values or too few samples; fallback",
        -3 => c"no reference: none has been set; fallback",
        BAD_POINTER => c"bad pointer: null or not aligned; fallback",
        TIME_ORDER => c"time order: the reference's time does not increase",
        UNKNOWN_FEET => c"unknown feet: no phase of the model has these feet in contact",
        BAD_SETTING => c"bad setting: a setting is out of its range",
        SOLVER_REFUSED => c"solver refused: the conic solver does not take the problem",
        INTERNAL => c"internal: the controller broke down; set a reference to use it again",
        _ => c"unknown status",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_has_a_text_and_that_of_a_status_begins_with_its_word() {
        let mut known: Vec<i32> = all_codes().collect();
        let unknown = c"unknown status";
        assert!(known.iter().all(|code| status_text(*code) != unknown));
        let count = known.len();
        known.sort_unstable();
        known.dedup();
        assert_eq!(known.len(), count);
        for status in Status::ALL {
            let text = status_text(status.code()).to_string_lossy();
            let word = status.word().replace('_', " ");
            assert!(text.starts_with(&format!("{word}:")), "{text}");
        }
        assert_eq!(status_text(77), unknown);
    }
}
