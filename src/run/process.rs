//! Settings for the C libraries' use of memory, made before they choose their own.

/// Before MPI starts. Large blocks of the set-up get their own pages, so that arrays that grow there
/// leave no holes in the heap. MPI asks hwloc about the machine; hwloc is kept from loading the libraries that find
/// graphics cards and read XML (a display server, OpenCL, libxml2, ICU).
pub fn before_start() {
    map_large_blocks(true);
    const LIST: &str = "HWLOC_PLUGINS_BLACKLIST";
    if std::env::var_os(LIST).is_none() {
        // SAFETY: the program has one thread so far.
        unsafe { std::env::set_var(LIST, "hwloc_gl.so,hwloc_opencl.so,hwloc_xml_libxml.so") };
    }
}

/// From the first step on: blocks that every step takes and gives back stay in the heap, where
/// they are reused without the system clearing their pages each time (a tenth to a third of a
/// step's time was measured). SuperLU_DIST, if PETSc is linked with it, sets this as it is loaded.
pub fn before_steps() {
    map_large_blocks(false);
}

fn map_large_blocks(map: bool) {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        const DEFAULT_MOST: libc::c_int = 65536;
        // SAFETY: sets a number of glibc's allocator; blocks in use stay as they are.
        unsafe { libc::mallopt(libc::M_MMAP_MAX, if map { DEFAULT_MOST } else { 0 }) };
    }
    #[cfg(not(all(target_os = "linux", target_env = "gnu")))]
    let _ = map;
}
