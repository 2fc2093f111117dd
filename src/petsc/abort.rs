//! All ranks end at once: for failures that cannot be passed on in an orderly way.

use std::io::Write as _;
use std::time::{Duration, Instant};

use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives};

use crate::error::Error;

/// How long a rank that failed inside the library waits for the others to fail as well.
const PATIENCE: Duration = Duration::from_secs(5);

/// A panic on one rank would leave the others waiting in MPI for ever: abort all instead.
pub fn install_panic_hook() {
    static ONCE: std::sync::Once = std::sync::Once::new();
    ONCE.call_once(|| {
        let previous = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            previous(info);
            abort_all(101);
        }));
    });
}

/// For an error from the inside of a collective PETSc call. Where all ranks have one, it comes back,
/// and the run can end in order. It may be one rank's, though (a file that only it opens, memory that
/// it does not get), and then the others wait for it in an exchange of PETSc's: all end.
pub(crate) fn unless_shared(comm: &SimpleCommunicator, error: Error) -> Error {
    let mut everybody = comm.immediate_barrier();
    let begin = Instant::now();
    while let Err(unfinished) = everybody.test() {
        if begin.elapsed() > PATIENCE {
            end_all(comm.rank(), &error);
        }
        everybody = unfinished;
        std::thread::sleep(Duration::from_millis(1));
    }
    error
}

/// For an error that other ranks may not see: they would wait for ever.
pub(crate) fn end_all(rank: i32, error: &Error) -> ! {
    end_all_with(rank, "", Some(error))
}

/// Ends all with the exit code of the `error`, or 0 without one, after a word beside it.
pub(crate) fn end_all_with(rank: i32, warning: &str, error: Option<&Error>) -> ! {
    if rank != 0 {
        // Where all have failed, the first speaks for all.
        std::thread::sleep(Duration::from_secs(2));
    }
    let mut words: Vec<String> = error.map(|error| format!("error: {error}")).into_iter().collect();
    words.extend((!warning.is_empty()).then(|| warning.to_string()));
    let _ = writeln!(std::io::stderr(), "{}", words.join("\n"));
    // Time for the line to get out: mpirun has much to say of an abort.
    std::thread::sleep(Duration::from_millis(300));
    abort_all(error.map_or(0, Error::exit_code))
}

/// Ends every rank with this exit code. Without a running MPI, ends this process.
fn abort_all(code: i32) -> ! {
    let (mut started, mut ended) = (0, 0);
    // SAFETY: the two questions may be asked at any time; the abort only while MPI runs.
    unsafe {
        mpi::ffi::MPI_Initialized(&mut started);
        mpi::ffi::MPI_Finalized(&mut ended);
        if started != 0 && ended == 0 {
            mpi::ffi::MPI_Abort(mpi::ffi::RSMPI_COMM_WORLD, code);
        }
    }
    std::process::exit(code)
}
