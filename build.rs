//! Finds PETSc and MPI and generates the raw PETSc bindings read from `ffi/petsc.h`.
//!
//! Search order: environment (`PKG_CONFIG_PATH`, `MPICC`), pkg-config, then MPI's compiler
//! wrapper. When something is missing, the build stops with the places looked at and the
//! Debian package that provides it.

use std::env;
use std::path::PathBuf;

const PETSC_NAMES: [&str; 2] = ["petsc", "PETSc"];
/// The first that serves, and the first that nobody has tried.
const PETSC_VERSIONS: (&str, &str) = ("3.18", "3.27");
/// Differences between versions of PETSc, read off the bindings: the flag that `src/petsc/sys.rs` asks
/// for, the beginning of a declaration, and what stands in its meaning where the flag is set.
const DIFFERENCES: [(&str, &str, &str); 4] = [
    ("petsc_bool", "pub type PetscBool ", "= bool"),
    ("petsc_any_function_returns", "pub fn MatShellSetOperation(", "fn() ->"),
    ("petsc_destroys_by_place", "pub fn MatShellSetContextDestroy(", "*mut *mut"),
    ("petsc_place_is_opaque", "pub fn MatShellSetContextDestroy(", "PetscCtxRt"),
];

fn main() {
    println!("cargo:rerun-if-changed=ffi/petsc.h");
    println!("cargo:rerun-if-changed=build.rs");

    let petsc = PETSC_NAMES
        .iter()
        .find_map(|name| {
            pkg_config::Config::new()
                .range_version(PETSC_VERSIONS.0..PETSC_VERSIONS.1)
                .probe(name)
                .ok()
        })
        .unwrap_or_else(|| match other_petsc() {
            Some((name, version)) => panic!(
                "\nPETSc {version} was found (pkg-config module `{name}`), and one from {} to below {} is \
                 needed, with real scalars.\n  try: libpetsc-real-dev of Debian 12 or 13; or build PETSc \
                 from https://petsc.org and put the folder of its PETSc.pc into PKG_CONFIG_PATH\n",
                PETSC_VERSIONS.0, PETSC_VERSIONS.1
            ),
            None => missing(
                "PETSc (real scalars, 3.18 to 3.26)",
                "libpetsc-real-dev",
                "pkg-config modules `petsc` and `PETSc`; set PKG_CONFIG_PATH to add a folder",
            ),
        });
    // A PETSc of the user's own is found at the start of a run, too.
    for path in petsc.link_paths.iter().filter(|path| !path.starts_with("/usr/lib")) {
        println!("cargo:rustc-link-arg=-Wl,-rpath,{}", path.display());
    }
    let mpi = build_probe_mpi::probe().unwrap_or_else(|_| {
        missing(
            "MPI",
            "libopenmpi-dev openmpi-bin",
            "the compiler wrapper named by MPICC, `mpicc` on PATH, pkg-config `mpich`/`openmpi`",
        )
    });
    if pkg_config::Config::new().cargo_metadata(false).probe("metis").is_err()
        && !["/usr/include/metis.h", "/usr/local/include/metis.h"]
            .iter()
            .any(|path| std::path::Path::new(path).exists())
    {
        missing::<()>(
            "METIS",
            "libmetis-dev",
            "pkg-config module `metis`, /usr/include, /usr/local/include",
        );
    }

    let mut builder = bindgen::Builder::default()
        .header("ffi/petsc.h")
        .use_core()
        .layout_tests(false)
        .generate_comments(false)
        .default_enum_style(bindgen::EnumVariation::Consts)
        .prepend_enum_name(false)
        .allowlist_function("(Petsc|PETSC_|Vec|Mat|KSP|PC|SNES|IS).*")
        .allowlist_type("(Petsc|Vec|Mat|KSP|PC|SNES|IS|Insert|Norm).*")
        .allowlist_var(
            "(PetscTrFree|PETSC|MAT|VEC|KSP|PC|SNES|IS_|INSERT|ADD|NORM|SUBSET|SAME|DIFFERENT).*",
        )
        .blocklist_type("MPI_.*|ompi_.*")
        .blocklist_function("P?MPI_.*")
        .blocklist_var("MPI_.*|ompi_.*|FP_.*")
        .raw_line(
            "pub use mpi_sys::{MPI_Comm, MPI_Datatype, MPI_Op, MPI_Request, MPI_Group, \
             MPI_Status, MPI_Win, MPI_Info, MPI_File, MPI_Offset};",
        );
    for path in petsc.include_paths.iter().chain(&mpi.include_paths) {
        builder = builder.clang_arg(format!("-I{}", path.display()));
    }
    let bindings = builder
        .generate()
        .unwrap_or_else(|error| panic!("bindgen could not read ffi/petsc.h: {error}"));
    let text = bindings.to_string();
    for (flag, declaration, word) in DIFFERENCES {
        println!("cargo:rustc-check-cfg=cfg({flag})");
        if meaning(&text, declaration).contains(word) {
            println!("cargo:rustc-cfg={flag}");
        }
    }
    let out = PathBuf::from(env::var("OUT_DIR").expect("cargo sets OUT_DIR")).join("petsc.rs");
    bindings
        .write_to_file(&out)
        .unwrap_or_else(|error| panic!("cannot write {}: {error}", out.display()));
}

/// The declaration that begins so, and after it those of the types it names: a version may give a type a
/// name, and a later one the name another meaning.
fn meaning(text: &str, beginning: &str) -> String {
    let declaration = |beginning: &str| {
        let from = text.find(beginning).map(|at| &text[at..]).unwrap_or_default();
        let words = from.split(';').next().unwrap_or_default().split_whitespace();
        words.collect::<Vec<&str>>().join(" ")
    };
    let mut all = declaration(beginning);
    for word in all.clone().split(|c: char| !c.is_alphanumeric() && c != '_') {
        if word.starts_with("Petsc") {
            all += &format!(" {}", declaration(&format!("pub type {word} ")));
        }
    }
    all
}

/// Name and version of a PETSc that is there and does not suit.
fn other_petsc() -> Option<(&'static str, String)> {
    PETSC_NAMES.iter().find_map(|name| {
        let found = pkg_config::Config::new().cargo_metadata(false).probe(name).ok()?;
        Some((*name, found.version))
    })
}

fn missing<T>(what: &str, package: &str, looked: &str) -> T {
    panic!(
        "\n{what} was not found.\n  looked in: {looked}\n  on Debian: apt-get install {package}\n  \
         (or run `make setup`)\n"
    )
}
