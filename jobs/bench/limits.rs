//! What the machine can do at most, measured beside what the program does: memory bandwidth by
//! the triad a = b + s c, arithmetic by independent chains of multiply-adds. Each bench takes what it
//! needs.
#![allow(dead_code)]

use super::report::processor_seconds;
use std::hint::black_box;

/// One instruction set and its peak rate on one core.
pub struct Peak {
    pub name: &'static str,
    /// 1e9 floating-point operations per second; a multiply-add counts as two.
    pub gflops: f64,
}

/// The limits that phases are held against.
#[derive(Debug, Clone, Copy)]
pub struct Machine {
    /// GB/s of one core.
    pub triad: f64,
    /// GFLOP/s of the baseline instruction set, which all but the assembly is compiled for.
    pub baseline: f64,
    /// GFLOP/s of the widest set that the assembly has a form for.
    pub wide: f64,
}

/// Measures the limits and prints them.
pub fn measured() -> Machine {
    let triad = triad();
    println!("triad bandwidth of one core: {triad:.1} GB/s");
    let peaks = peaks();
    for peak in &peaks {
        println!("peak arithmetic, {}: {:.1} GFLOP/s", peak.name, peak.gflops);
    }
    let of = |name: &str| peaks.iter().find(|peak| peak.name == name).map(|peak| peak.gflops);
    let baseline = of("baseline").unwrap_or(f64::NAN);
    Machine { triad, baseline, wide: of("avx2+fma").unwrap_or(baseline) }
}

/// Values of one array of the triad: none of the three stays in a cache.
const LENGTH: usize = 12_000_000;

/// Triad bandwidth of `cores` cores at once, GB/s together, counting three arrays once each: the
/// best of several passes that all of them begin together, by wall time.
pub fn triad_of(cores: usize) -> f64 {
    use std::sync::Barrier;
    use std::time::Instant;
    const PASSES: usize = 12;
    let start = Barrier::new(cores);
    let passes: Vec<Vec<(Instant, Instant)>> = std::thread::scope(|scope| {
        let stream = || {
            let (b, c) = (vec![1.5f64; LENGTH], vec![0.25f64; LENGTH]);
            let mut a = vec![0.0f64; LENGTH];
            let pass = |pass: usize| {
                let factor = black_box(3.0 + pass as f64);
                start.wait();
                let begin = Instant::now();
                for ((a, b), c) in a.iter_mut().zip(&b).zip(&c) {
                    *a = b + factor * c;
                }
                black_box(&mut a);
                (begin, Instant::now())
            };
            (0..PASSES).map(pass).collect()
        };
        let threads: Vec<_> = (0..cores).map(|_| scope.spawn(stream)).collect();
        threads.into_iter().map(|thread| thread.join().expect("a pass ends")).collect()
    });
    let seconds = (0..PASSES).map(|k| {
        let begin = passes.iter().map(|pass| pass[k].0).min().expect("a core");
        let end = passes.iter().map(|pass| pass[k].1).max().expect("a core");
        (end - begin).as_secs_f64()
    });
    let best = seconds.fold(f64::INFINITY, f64::min);
    (cores * 3 * LENGTH * size_of::<f64>()) as f64 / best * 1e-9
}

/// Triad bandwidth of one core, GB/s, counting three arrays once each (best of several passes).
pub fn triad() -> f64 {
    let (b, c) = (vec![1.5f64; LENGTH], vec![0.25f64; LENGTH]);
    let mut a = vec![0.0f64; LENGTH];
    let mut best = f64::INFINITY;
    for pass in 0..8 {
        let factor = black_box(3.0 + pass as f64);
        let begin = processor_seconds();
        for ((a, b), c) in a.iter_mut().zip(&b).zip(&c) {
            *a = b + factor * c;
        }
        black_box(&mut a);
        best = best.min(processor_seconds() - begin);
    }
    (3 * LENGTH * size_of::<f64>()) as f64 / best * 1e-9
}

const CHAINS: usize = 16;
const TURNS: usize = 2_000_000;

/// Peak rates of the instruction sets this processor has.
pub fn peaks() -> Vec<Peak> {
    let mut peaks = vec![Peak { name: "baseline", gflops: rate(2, baseline) }];
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            // SAFETY: the features were just found.
            peaks.push(Peak { name: "avx2+fma", gflops: rate(4, |s| unsafe { avx2(s) }) });
        }
        if is_x86_feature_detected!("avx512f") {
            // SAFETY: the feature was just found.
            peaks.push(Peak { name: "avx-512", gflops: rate(8, |s| unsafe { avx512(s) }) });
        }
    }
    peaks
}

fn rate(width: usize, run: impl Fn(f64) -> f64) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let begin = processor_seconds();
        black_box(run(black_box(1e-9)));
        best = best.min(processor_seconds() - begin);
    }
    (2 * width * CHAINS * TURNS) as f64 / best * 1e-9
}

/// What the default target offers: on x86-64 two doubles at a time, multiply and add apart.
fn baseline(seed: f64) -> f64 {
    let mut sums = [[seed; 2]; CHAINS];
    let (m, a) = (black_box(0.999_999), black_box(1e-9));
    for _ in 0..TURNS {
        for pair in &mut sums {
            for value in pair {
                *value = *value * m + a;
            }
        }
    }
    sums.iter().flatten().sum()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn avx2(seed: f64) -> f64 {
    use std::arch::x86_64::*;
    // Eight chains hide the latency; more would not fit the sixteen registers.
    let (m, a) = (_mm256_set1_pd(black_box(0.999_999)), _mm256_set1_pd(black_box(1e-9)));
    let mut sums = [_mm256_set1_pd(seed); 8];
    for _ in 0..TURNS * CHAINS / 8 {
        for sum in &mut sums {
            *sum = _mm256_fmadd_pd(*sum, m, a);
        }
    }
    let mut total = 0.0;
    for sum in sums {
        let mut out = [0.0; 4];
        // SAFETY: four doubles fit the array.
        unsafe { _mm256_storeu_pd(out.as_mut_ptr(), sum) };
        total += out.iter().sum::<f64>();
    }
    total
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn avx512(seed: f64) -> f64 {
    use std::arch::x86_64::*;
    let (m, a) = (_mm512_set1_pd(black_box(0.999_999)), _mm512_set1_pd(black_box(1e-9)));
    let mut sums = [_mm512_set1_pd(seed); CHAINS];
    for _ in 0..TURNS {
        for sum in &mut sums {
            *sum = _mm512_fmadd_pd(*sum, m, a);
        }
    }
    sums.into_iter().map(|sum| _mm512_reduce_add_pd(sum)).sum()
}
