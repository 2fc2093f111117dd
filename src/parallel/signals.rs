//! Signals that ask a run to end in good order: batch systems send SIGUSR1 or SIGTERM some time
//! before they kill, a terminal sends SIGINT for Ctrl-C. A handler only notes the number; the time loop asks
//! between two steps. A second Ctrl-C ends the process at once.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};

use super::World;

static NOTED: AtomicI32 = AtomicI32::new(0);
/// Whether somebody reads what this process says.
static IS_READ: AtomicBool = AtomicBool::new(false);

/// A wish to stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Signal {
    Terminate,
    User1,
    Interrupt,
}

impl Signal {
    const ALL: [Signal; 3] = [Signal::Terminate, Signal::User1, Signal::Interrupt];

    fn number(self) -> libc::c_int {
        match self {
            Signal::Terminate => libc::SIGTERM,
            Signal::User1 => libc::SIGUSR1,
            Signal::Interrupt => libc::SIGINT,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Signal::Terminate => "SIGTERM",
            Signal::User1 => "SIGUSR1",
            Signal::Interrupt => "SIGINT",
        }
    }
}

extern "C" fn note(number: libc::c_int) {
    NOTED.store(number, Ordering::Relaxed);
    if number != libc::SIGINT {
        return;
    }
    // SAFETY: a signal handler may call signal() and write(); the text outlives the call.
    unsafe {
        libc::signal(libc::SIGINT, libc::SIG_DFL);
        if IS_READ.load(Ordering::Relaxed) {
            let text = b"\nstopping after this step; Ctrl-C again ends at once\n";
            libc::write(libc::STDERR_FILENO, text.as_ptr().cast(), text.len());
        }
    }
}

/// From now on the signals are noted instead of ending the process.
pub fn listen() {
    IS_READ.store(std::io::stderr().is_terminal(), Ordering::Relaxed);
    for signal in Signal::ALL {
        let handler: extern "C" fn(libc::c_int) = note;
        // SAFETY: the handler only stores to an atomic, which a signal handler may do.
        unsafe { libc::signal(signal.number(), handler as libc::sighandler_t) };
    }
}

/// The signal that any rank has received, the same on all ranks, and whether `also` holds on
/// any. One reduction. Collective.
pub fn received(world: &World, also: bool) -> (Option<Signal>, bool) {
    let noted = NOTED.load(Ordering::Relaxed);
    let own = Signal::ALL.iter().position(|signal| signal.number() == noted);
    let wishes = [own.map_or(0.0, |index| (index + 1) as f64), f64::from(u8::from(also))];
    let wishes = world.max_slice(&wishes);
    let signal = (wishes[0] as usize).checked_sub(1).map(|index| Signal::ALL[index]);
    (signal, wishes[1] > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_is_noted_and_the_process_lives() {
        listen();
        // SAFETY: sends a signal for which a handler was installed above.
        unsafe { libc::raise(libc::SIGUSR1) };
        assert_eq!(NOTED.load(Ordering::Relaxed), libc::SIGUSR1);
        NOTED.store(0, Ordering::Relaxed);
    }
}
