//! How the values of blocks are kept, in single or in double precision, and what their kernels share.

/// A number as it is stored; it is computed with in double precision.
pub trait Stored: Copy + Default + Into<f64> + Send + Sync + 'static {
    /// Whether values are kept in double precision.
    const DOUBLE: bool;
    /// The value as it is kept.
    fn rounded(value: f64) -> Self;
}

impl Stored for f32 {
    const DOUBLE: bool = false;
    fn rounded(value: f64) -> Self {
        value as f32
    }
}

impl Stored for f64 {
    const DOUBLE: bool = true;
    fn rounded(value: f64) -> Self {
        value
    }
}

/// Kernels load four values at a time: the last one may lie beyond a block of 3x3.
pub(crate) const BEYOND: usize = 1;

/// Values are fetched so many bytes before they are used: the rows are too short for the processor to foresee the
/// next ones.
pub(crate) const AHEAD: usize = 8192;

/// Fetches what lies `ahead` bytes further on into the cache.
#[inline(always)]
pub(crate) fn fetch<T>(here: *const T, ahead: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: a hint that reads nothing, whatever the address.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(here.cast::<i8>().wrapping_add(ahead)) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (here, ahead);
}

/// Four values in a vector.
///
/// # Safety
/// They are there.
#[cfg(target_arch = "x86_64")]
#[inline]
#[target_feature(enable = "avx2,fma")]
pub(crate) unsafe fn load<T: Stored>(from: *const T) -> std::arch::x86_64::__m256d {
    use std::arch::x86_64::{_mm_loadu_ps, _mm256_cvtps_pd, _mm256_loadu_pd};
    // SAFETY: the caller's, and the type is the one that `DOUBLE` says.
    unsafe {
        if T::DOUBLE {
            _mm256_loadu_pd(from.cast())
        } else {
            _mm256_cvtps_pd(_mm_loadu_ps(from.cast()))
        }
    }
}
