//! What the writing of files asks of the process before MPI starts.

/// A write that fails is to return its error and nothing else.
///
/// A file-size limit would end the process by a signal. HDF5 started under MPI ties its end to
/// that of MPI: files that could not be closed would be closed once more, which crashes; started
/// before, it leaves them alone. And HDF5's locks, which some network file systems refuse, protect
/// nothing here: only one process has a file open in HDF5 while it is written.
pub fn before_mpi() {
    const LOCKS: &str = "HDF5_USE_FILE_LOCKING";
    if std::env::var_os(LOCKS).is_none() {
        // SAFETY: the program has one thread so far.
        unsafe { std::env::set_var(LOCKS, "FALSE") };
    }
    // SAFETY: a signal that nothing else here knows of is ignored.
    unsafe { libc::signal(libc::SIGXFSZ, libc::SIG_IGN) };
    hdf5::sync::sync(|| {});
}
