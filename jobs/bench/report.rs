//! Repeated timings and what the machine is called. Each bench takes what it needs.
#![allow(dead_code)]

use std::fmt;

/// Counted runs of each part, after one that is not counted.
pub const RUNS: usize = 7;

/// Processor time of this thread, s: waiting for a processor that others use does not count.
pub fn processor_seconds() -> f64 {
    #[repr(C)]
    struct Time {
        seconds: i64,
        nanoseconds: i64,
    }
    const THREAD_TIME: i32 = 3;
    unsafe extern "C" {
        fn clock_gettime(clock: i32, time: *mut Time) -> i32;
    }
    let mut time = Time { seconds: 0, nanoseconds: 0 };
    // SAFETY: the C library of a 64-bit Linux fills a structure of this layout.
    unsafe { clock_gettime(THREAD_TIME, &mut time) };
    time.seconds as f64 + 1e-9 * time.nanoseconds as f64
}

/// Nanoseconds per point.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    pub median: f64,
    pub least: f64,
}

impl fmt::Display for Sample {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.0} ({:.0})", self.median, self.least)
    }
}

/// Times `work` over `count` points.
pub fn sample(count: usize, mut work: impl FnMut()) -> Sample {
    let [sample] = sample_parts(count, |_| work());
    sample
}

/// Times each of the parts 0, 1, ... of `work`, which follow each other, over `count` points.
pub fn sample_parts<const N: usize>(count: usize, mut work: impl FnMut(usize)) -> [Sample; N] {
    (0..N).for_each(&mut work);
    let mut times = [[0.0; RUNS]; N];
    for run in 0..RUNS {
        for (part, times) in times.iter_mut().enumerate() {
            let begin = processor_seconds();
            work(part);
            times[run] = (processor_seconds() - begin) * 1e9 / count as f64;
        }
    }
    times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        Sample { median: times[RUNS / 2], least: times[0] }
    })
}

/// Processor model, cores, memory.
pub fn machine() -> String {
    let read = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
    let field = |text: &str, name: &str| {
        text.lines()
            .find(|line| line.starts_with(name))
            .and_then(|line| line.split(':').nth(1))
            .map_or("unknown".to_string(), |value| value.trim().to_string())
    };
    let cores = std::thread::available_parallelism().map_or(0, usize::from);
    let memory = field(&read("/proc/meminfo"), "MemTotal");
    let kib: f64 = memory.trim_end_matches(" kB").parse().unwrap_or(0.0);
    format!(
        "{}, {cores} hardware threads, {:.0} GiB",
        field(&read("/proc/cpuinfo"), "model name"),
        kib / 1024.0 / 1024.0
    )
}

/// Resident memory of this process, bytes.
pub fn resident_bytes() -> f64 {
    let status = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let pages: f64 =
        status.split_whitespace().nth(1).and_then(|word| word.parse().ok()).unwrap_or(0.0);
    pages * 4096.0
}

/// Processor time of all children that have ended, s.
pub fn children_seconds() -> f64 {
    // SAFETY: the structure is plain numbers, which the call fills in.
    let usage = unsafe {
        let mut usage: libc::rusage = std::mem::zeroed();
        libc::getrusage(libc::RUSAGE_CHILDREN, &mut usage);
        usage
    };
    let seconds = |t: libc::timeval| t.tv_sec as f64 + 1e-6 * t.tv_usec as f64;
    seconds(usage.ru_utime) + seconds(usage.ru_stime)
}
