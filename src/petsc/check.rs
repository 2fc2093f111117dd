//! PETSc's return codes become errors, and an error of one rank becomes an error of all.

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::sync::Mutex;

use mpi::collective::SystemOperation;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives, Root};

use super::sys;
use crate::error::{Error, Result};

/// Calls a PETSc function and turns its return code into a `Result`. After `->` stands what its last
/// argument, the place of an answer, holds before; the answer is the result's value.
macro_rules! petsc {
    ($function:ident($($argument:expr),* $(,)?) -> $before:expr) => {{
        let mut answer = $before;
        $crate::petsc::check::petsc!($function($($argument,)* &mut answer)).map(|()| answer)
    }};
    ($function:ident($($argument:expr),* $(,)?)) => {
        $crate::petsc::check::check(
            // SAFETY: the caller of the macro guarantees live handles and valid pointers.
            unsafe { $crate::petsc::sys::$function($($argument),*) },
            stringify!($function),
        )
    };
}
pub(crate) use petsc;

/// What PETSc said about the error that is travelling up its stack.
static MESSAGE: Mutex<String> = Mutex::new(String::new());

/// Error handler: keeps the first message and the names of the functions it passed through.
pub(crate) unsafe extern "C" fn remember(
    _comm: sys::MPI_Comm,
    line: c_int,
    function: *const c_char,
    _file: *const c_char,
    code: sys::PetscErrorCode,
    kind: sys::PetscErrorType,
    text: *const c_char,
    _context: *mut c_void,
) -> sys::PetscErrorCode {
    let function = text_of(function);
    if let Ok(mut message) = MESSAGE.lock() {
        if kind == sys::PETSC_ERROR_INITIAL {
            *message = format!("{} (in {function}, line {line})", text_of(text).trim());
        } else if !function.is_empty() && function != "User provided function" {
            message.push_str(" < ");
            message.push_str(&function);
        }
    }
    code
}

/// `Ok` for zero; otherwise the stored message. A failed pivot, a floating-point exception or a
/// solver that did not converge is the run's failure, everything else the environment's.
pub(crate) fn check(code: sys::PetscErrorCode, function: &str) -> Result<()> {
    if code == 0 {
        return Ok(());
    }
    let detail = MESSAGE.lock().map(|mut m| std::mem::take(&mut *m)).unwrap_or_default();
    let text = format!("PETSc error {code} from {function}: {detail}");
    // Signed or not, as PETSc's version has it.
    let of_the_run = [
        sys::PETSC_ERR_FP as sys::PetscErrorCode,
        sys::PETSC_ERR_CONV_FAILED as sys::PetscErrorCode,
        sys::PETSC_ERR_NOT_CONVERGED as sys::PetscErrorCode,
        sys::PETSC_ERR_MAT_LU_ZRPVT as sys::PetscErrorCode,
        sys::PETSC_ERR_MAT_CH_ZRPVT as sys::PetscErrorCode,
    ];
    Err(if of_the_run.contains(&code) { Error::Run(text) } else { Error::Environment(text) })
}

/// PETSc's own words in an error of [`check`], without the trace around them.
pub(crate) fn essence(error: &Error) -> String {
    let text = error.to_string();
    let text = text.split_once(": ").map_or(text.as_str(), |(_, rest)| rest);
    text.split(" (in ").next().unwrap_or(text).lines().next().unwrap_or(text).trim().to_string()
}

/// The return code of a callback of our own; the text of a failure is there for the caller of PETSc.
pub(crate) fn code_of(outcome: Result<()>) -> sys::PetscErrorCode {
    let Err(error) = outcome else { return 0 };
    if let Ok(mut message) = MESSAGE.lock() {
        *message = error.to_string();
    }
    sys::PETSC_ERR_USER as sys::PetscErrorCode
}

/// Copy of a C string; empty for null.
pub(crate) fn text_of(text: *const c_char) -> String {
    if text.is_null() {
        return String::new();
    }
    // SAFETY: not null, and PETSc's strings end in a zero byte.
    unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
}

/// Gives back memory that PETSc allocated for the caller; `PetscFree` is a macro over this pointer.
pub(crate) fn free<T>(memory: *mut T) {
    // SAFETY: PETSc's own function for memory of its own; null is left alone.
    unsafe {
        if let Some(free) = sys::PetscTrFree {
            free(memory.cast(), 0, c"free".as_ptr(), c"check.rs".as_ptr());
        }
    }
}

pub(crate) fn c_text(text: &str) -> Result<CString> {
    CString::new(text)
        .map_err(|_| Error::Input(format!("`{}` holds a zero byte", text.escape_debug())))
}

/// True between `PetscInitialize` and `PetscFinalize`.
pub(crate) fn running() -> bool {
    let (mut started, mut ended) = (sys::PETSC_FALSE, sys::PETSC_FALSE);
    // SAFETY: both functions may be called at any time and only write the flag.
    unsafe {
        sys::PetscInitialized(&mut started);
        sys::PetscFinalized(&mut ended);
    }
    started != sys::PETSC_FALSE && ended == sys::PETSC_FALSE
}

pub(crate) fn require_running() -> Result<()> {
    if running() {
        Ok(())
    } else {
        Err(Error::Environment("PETSc is used outside its session".into()))
    }
}

pub(crate) fn bool_of(flag: bool) -> sys::PetscBool {
    if flag { sys::PETSC_TRUE } else { sys::PETSC_FALSE }
}

/// Collective. If any rank brings an error, all ranks return the error of the lowest such rank;
/// otherwise each gets its own value back.
pub fn agree<T>(comm: &SimpleCommunicator, result: Result<T>) -> Result<T> {
    if comm.size() == 1 {
        return result;
    }
    let mine = if result.is_err() { comm.rank() } else { i32::MAX };
    let mut first = i32::MAX;
    comm.all_reduce_into(&mine, &mut first, SystemOperation::min());
    if first == i32::MAX {
        return result;
    }
    let (mut kind, mut text) = match &result {
        Err(error) if mine == first => (error.exit_code(), error.to_string().into_bytes()),
        _ => (0, Vec::new()),
    };
    let root = comm.process_at_rank(first);
    let mut head = [i64::from(kind), text.len() as i64];
    root.broadcast_into(&mut head[..]);
    kind = head[0] as i32;
    text.resize(head[1] as usize, 0);
    root.broadcast_into(&mut text[..]);
    let text = String::from_utf8_lossy(&text).into_owned();
    Err(match kind {
        1 => Error::Run(text),
        2 => Error::Input(text),
        3 => Error::File(text),
        _ => Error::Environment(text),
    })
}
