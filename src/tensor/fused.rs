//! Products of small matrices of fixed size for inner loops: plain code that the compiler turns into
//! the vector instructions of the function it lands in. Such a function exists twice, with
//! `FUSED` for processors that round a b + c once.

#[cfg(target_arch = "x86_64")]
use std::sync::OnceLock;

/// `R` x `C` values, row first.
pub type Block<const R: usize, const C: usize> = [[f64; C]; R];

/// Whether the forms for AVX2 and fused multiply-add can run here. The environment variable
/// `MPM_PAR_AVX2=off` says no, to see what round-off decides.
#[cfg(target_arch = "x86_64")]
#[inline]
pub fn has_avx2() -> bool {
    static HAS: OnceLock<bool> = OnceLock::new();
    *HAS.get_or_init(|| {
        let wanted = std::env::var_os("MPM_PAR_AVX2").is_none_or(|word| word != "off");
        wanted && is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
    })
}

/// a b + c, rounded once where the instruction set can.
#[inline(always)]
pub fn multiply_add<const FUSED: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

/// sum += a b.
#[inline(always)]
pub fn add_product<const R: usize, const M: usize, const C: usize, const FUSED: bool>(
    sum: &mut Block<R, C>,
    a: &Block<R, M>,
    b: &Block<M, C>,
) {
    for r in 0..R {
        for m in 0..M {
            for c in 0..C {
                sum[r][c] = multiply_add::<FUSED>(a[r][m], b[m][c], sum[r][c]);
            }
        }
    }
}

/// sum += a^T b.
#[inline(always)]
pub fn add_transposed_product<const M: usize, const R: usize, const C: usize, const FUSED: bool>(
    sum: &mut Block<R, C>,
    a: &Block<M, R>,
    b: &Block<M, C>,
) {
    for r in 0..R {
        for m in 0..M {
            for c in 0..C {
                sum[r][c] = multiply_add::<FUSED>(a[m][r], b[m][c], sum[r][c]);
            }
        }
    }
}
