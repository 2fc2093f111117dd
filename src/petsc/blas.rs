//! Which kernel the BLAS under the direct solvers runs: OpenBLAS picks one by the processor at its
//! start, and takes the generic one for a processor that is newer than itself.

use std::ffi::{CStr, c_char};

use crate::tensor::fused;

/// Kernels for any x86-64 processor.
const GENERIC: [&str; 2] = ["Prescott", "Generic"];

/// OpenBLAS's name for its kernel; `None` where the BLAS is another one.
pub fn kernel() -> Option<String> {
    // SAFETY: asks the libraries of this process for a symbol; the name ends with a zero.
    let symbol = unsafe { libc::dlsym(libc::RTLD_DEFAULT, c"openblas_get_corename".as_ptr()) };
    if symbol.is_null() {
        return None;
    }
    // SAFETY: OpenBLAS declares `char *openblas_get_corename(void)`, which returns a constant of
    // the library or null.
    let name = unsafe {
        let get: extern "C" fn() -> *const c_char = std::mem::transmute(symbol);
        get()
    };
    if name.is_null() {
        return None;
    }
    // SAFETY: not null, and a constant text that ends with a zero.
    let name = unsafe { CStr::from_ptr(name) };
    Some(name.to_string_lossy().into_owned())
}

/// What a user should know of it: nothing unless the kernel is the generic one.
pub fn note() -> Option<String> {
    let kernel = kernel().filter(|kernel| GENERIC.contains(&kernel.as_str()))?;
    let chosen = std::env::var_os("OPENBLAS_CORETYPE").is_some();
    let better = match fused::has_avx2() && !chosen {
        true => "; OPENBLAS_CORETYPE=Haswell, or a newer OpenBLAS, serves this processor better",
        false => "",
    };
    Some(format!(
        "note: OpenBLAS runs its generic kernel ({kernel}), and direct solves take several times \
         longer{better}"
    ))
}
