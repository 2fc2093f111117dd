//! Options that no solver knows are refused before the run. PETSc would ignore them.
//!
//! Each option that is still unread after the start is shown, under a name of its own, to solvers of
//! all kinds that PETSc has: an option that none of them reads is a mistake. A run warns at its end of
//! an option that is known but was not used. PETSc cannot be asked for the names that it reads later,
//! or under prefixes of its own: those are listed here.

use std::ptr::null_mut;

use super::check::{c_text, essence, free, petsc, text_of};
use super::object::Object;
use super::{options, sys};
use crate::deck::PETSC_PREFIXES as PREFIXES;
use crate::error::{Error, Result};

/// Prefixes that PETSc puts before the options of solvers inside solvers.
const NESTED: [&str; 12] = [
    "pc_gamg_esteig_",
    "telescope_",
    "mg_levels_",
    "mg_tied_",
    "mg_flow_",
    "mg_coarse_",
    "mg_fine_",
    "sub_",
    "esteig_",
    "redundant_",
    "inner_",
    "npc_",
];
/// Beginnings of names that are read only while a system is solved.
const READ_LATER: [&str; 8] = [
    "mat_",
    "vec_",
    "ksp_view",
    "ksp_converged",
    "ksp_monitor",
    "snes_view",
    "snes_converged",
    "snes_monitor",
];
/// Beginnings of unprefixed names that belong to no solver, or are read at PETSc's end.
const GENERAL: [&str; 18] = [
    "log",
    "options_",
    "malloc",
    "memory_",
    "objects_",
    "info",
    "on_error",
    "help",
    "version",
    "viewer",
    "get_total_flops",
    "saws",
    "mat",
    "vec",
    "sf_",
    "is_",
    "ao_",
    "petsc",
];
/// These would solve with a matrix that the next residual has already changed.
const WITHOUT_TANGENT: [&str; 4] =
    ["snes_lag_jacobian", "snes_lag_jacobian_persists", "snes_mf", "snes_mf_operator"];
/// Limits of linear solvers that PETSc takes as they are.
const NOT_NEGATIVE: [&str; 4] = ["ksp_max_it", "ksp_rtol", "ksp_atol", "ksp_divtol"];
/// Nonlinear solvers that assemble and solve as [`super::snes`] needs it.
const NEWTON: [&str; 2] = ["newtonls", "newtontr"];
/// Names that are proposed for a misspelt one.
const USUAL: [&str; 22] = [
    "ksp_type",
    "ksp_rtol",
    "ksp_atol",
    "ksp_divtol",
    "ksp_max_it",
    "ksp_monitor",
    "ksp_view",
    "ksp_converged_reason",
    "ksp_gmres_restart",
    "ksp_norm_type",
    "pc_type",
    "pc_factor_mat_solver_type",
    "pc_factor_shift_type",
    "pc_hypre_type",
    "pc_gamg_threshold",
    "pc_gamg_type",
    "mg_levels_ksp_type",
    "mg_levels_pc_type",
    "mg_coarse_pc_type",
    "mat_mumps_icntl_14",
    "snes_monitor",
    "snes_linesearch_type",
];
/// The prefix under which solvers are shown the options.
const PROBE: &str = "probe_";

/// An error that names every option nobody could know, and values that PETSc refuses. Call it
/// on all ranks after the session's start, before any solver is made.
pub fn require_known() -> Result<()> {
    let mut problems = Vec::new();
    for option in options::unused()? {
        let (name, value) = option.split_once(' ').unwrap_or((&option, ""));
        let bare = name.trim_start_matches('-');
        if let Some(why) = fatal(bare, value) {
            problems.push(format!("{option}: {why}"));
            continue;
        }
        match judge(bare, value)? {
            Answer::Known => {}
            Answer::Unknown => problems.push(unknown(bare)?),
            Answer::Refused(why) => {
                problems.push(format!("PETSc does not accept {option}: {why}"));
            }
            Answer::Unsuited(why) => problems.push(format!("{option}: {why}")),
        }
    }
    if problems.is_empty() { Ok(()) } else { Err(Error::Input(problems.join("\n"))) }
}

/// Why an option would end in a crash or a standstill inside PETSc (3.18), which it does not see
/// itself.
fn fatal(name: &str, value: &str) -> Option<&'static str> {
    let own = PREFIXES.iter().find_map(|prefix| name.strip_prefix(prefix))?;
    match without_nesting(own) {
        "pc_mg_levels" => Some(
            "the levels of multigrid are made as the system needs them; pc_gamg_coarse_eq_limit \
             bounds those of gamg",
        ),
        "pc_gamg_type" if value == "classical" => {
            Some("it waits for ever on several ranks: use agg, which is the default")
        }
        // An error in the middle of the method leaves a work vector in the place of the solution.
        "ksp_type" if own == "ksp_type" && value == "chebyshev" => Some(
            "PETSc frees a vector of it twice when it fails: use cg, and chebyshev in the levels of \
             multigrid (mg_levels_ksp_type)",
        ),
        _ => None,
    }
}

#[derive(Debug, PartialEq)]
enum Answer {
    Known,
    Unknown,
    /// By PETSc.
    Refused(String),
    /// By this program.
    Unsuited(String),
}

fn judge(name: &str, value: &str) -> Result<Answer> {
    let begins = |list: &[&str], name: &str| list.iter().any(|word| name.starts_with(word));
    let Some(own) = PREFIXES.iter().find_map(|prefix| name.strip_prefix(prefix)) else {
        return Ok(if begins(&GENERAL, name) { Answer::Known } else { Answer::Unknown });
    };
    if own.starts_with("npc_") || (own == "snes_type" && !NEWTON.contains(&value)) {
        let why = format!("the equations are solved by {}", NEWTON.join(" or "));
        return Ok(Answer::Unsuited(why));
    }
    if WITHOUT_TANGENT.contains(&own) && !(own == "snes_lag_jacobian" && value == "1") {
        return Ok(Answer::Unsuited("the tangent is assembled with every residual".into()));
    }
    let base = without_nesting(own);
    if NOT_NEGATIVE.contains(&base) && value.parse().is_ok_and(|number: f64| number < 0.0) {
        return Ok(Answer::Unsuited("expected a number >= 0".into()));
    }
    if begins(&READ_LATER, base) { Ok(Answer::Known) } else { ask(base, value) }
}

/// `mg_levels_1_pc_type` is `pc_type` of a solver inside.
pub(crate) fn without_nesting(mut name: &str) -> &str {
    loop {
        let inner = NESTED
            .iter()
            .find_map(|word| name.strip_prefix(word))
            .or_else(|| {
                name.strip_prefix("fieldsplit_").and_then(|rest| Some(rest.split_once('_')?.1))
            })
            .or_else(|| {
                name.strip_prefix("ksp_")
                    .filter(|rest| rest.starts_with("ksp_") || rest.starts_with("pc_"))
                    .filter(|rest| *rest != "pc_side")
            });
        let Some(inner) = inner else { return name };
        let digits = inner.trim_start_matches(|c: char| c.is_ascii_digit());
        name = if digits.len() < inner.len() {
            digits.strip_prefix('_').unwrap_or(inner)
        } else {
            inner
        };
    }
}

/// Shows the option to solvers of all kinds. Its value is refused if all do that know the name:
/// other values may suit the run's kind only.
fn ask(base: &str, value: &str) -> Result<Answer> {
    let kinds = if base.starts_with("snes_") {
        vec![Kind::Newton]
    } else {
        let (methods, preconditioners) = registered()?;
        let methods = methods.into_iter().map(|method| Kind::Linear(method, "none".into()));
        let inside = |pc| Kind::Linear("preonly".into(), pc);
        methods.chain(preconditioners.into_iter().map(inside)).collect()
    };
    let shown = format!("-{PROBE}{base}");
    let mut refused = None;
    for kind in kinds {
        // A kind that this PETSc lacks, or that cannot be set up alone, has no say.
        if kind.read_options().is_err() {
            continue;
        }
        options::set(&shown, value)?;
        let outcome = kind.read_options();
        let mut used = sys::PETSC_FALSE;
        // The database keeps names without their dash.
        let stored = c_text(shown.trim_start_matches('-'))?;
        petsc!(PetscOptionsUsed(null_mut(), stored.as_ptr(), &mut used))?;
        options::clear(&shown)?;
        if used != sys::PETSC_FALSE {
            match outcome {
                Ok(()) => return Ok(Answer::Known),
                Err(error) => {
                    refused.get_or_insert_with(|| Answer::Refused(essence(&error)));
                }
            }
        }
    }
    Ok(refused.unwrap_or(Answer::Unknown))
}

fn unknown(name: &str) -> Result<String> {
    let own = PREFIXES.iter().find(|prefix| name.starts_with(**prefix));
    let rest = own.map_or(name, |prefix| &name[prefix.len()..]);
    if own.is_none() && judge(&format!("qs_{name}"), "")? != Answer::Unknown {
        return Ok(format!(
            "unknown PETSc option -{name}: options of the equilibrium solver begin with -qs_, of \
             the mass solver with -mass_; did you mean -qs_{name}?"
        ));
    }
    let nearest = USUAL
        .iter()
        .map(|usual| (strsim::jaro_winkler(rest, usual), usual))
        .filter(|(likeness, _)| *likeness > 0.85)
        .max_by(|a, b| a.0.total_cmp(&b.0));
    let prefix = own.unwrap_or(&"qs_");
    let hint =
        nearest.map_or(String::new(), |(_, usual)| format!("; did you mean -{prefix}{usual}?"));
    Ok(format!("unknown PETSc option -{name}{hint}"))
}

/// Names of the methods and of the preconditioners that this PETSc has.
fn registered() -> Result<(Vec<String>, Vec<String>)> {
    petsc!(KSPInitializePackage())?;
    petsc!(PCInitializePackage())?;
    // SAFETY: PETSc has filled both lists and keeps them.
    let (methods, preconditioners) = unsafe { (sys::KSPList, sys::PCList) };
    Ok((names_in(methods)?, names_in(preconditioners)?))
}

fn names_in(list: sys::PetscFunctionList) -> Result<Vec<String>> {
    let (mut names, mut count) = (null_mut(), 0);
    petsc!(PetscFunctionListGet(list, &mut names, &mut count))?;
    // SAFETY: PETSc returned `count` names.
    let texts = (0..count as usize).map(|k| text_of(unsafe { *names.add(k) })).collect();
    free(names);
    Ok(texts)
}

/// A solver that is made only to read its options.
enum Kind {
    Newton,
    /// Method and preconditioner.
    Linear(String, String),
}

impl Kind {
    fn read_options(&self) -> Result<()> {
        match self {
            Kind::Newton => newton(),
            Kind::Linear(method, pc) => linear(method, pc),
        }
    }
}

/// All ranks: some values suit as many as there are.
fn world() -> sys::MPI_Comm {
    // SAFETY: a constant of a running MPI.
    unsafe { mpi::ffi::RSMPI_COMM_WORLD }
}

fn newton() -> Result<()> {
    let prefix = c_text(PROBE)?;
    let snes = Object(petsc!(SNESCreate(world()) -> null_mut())?);
    petsc!(SNESSetOptionsPrefix(snes.0, prefix.as_ptr()))?;
    petsc!(SNESSetType(snes.0, sys::SNESNEWTONLS.as_ptr().cast()))?;
    petsc!(SNESSetFromOptions(snes.0))
}

fn linear(method: &str, pc_type: &str) -> Result<()> {
    let (prefix, method, pc_name) = (c_text(PROBE)?, c_text(method)?, c_text(pc_type)?);
    let ksp = Object(petsc!(KSPCreate(world()) -> null_mut())?);
    petsc!(KSPSetOptionsPrefix(ksp.0, prefix.as_ptr()))?;
    petsc!(KSPSetType(ksp.0, method.as_ptr()))?;
    let pc = petsc!(KSPGetPC(ksp.0) -> null_mut())?;
    petsc!(PCSetType(pc, pc_name.as_ptr()))?;
    petsc!(KSPSetFromOptions(ksp.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nested_prefixes_are_taken_off() {
        for (name, base) in [
            ("pc_type", "pc_type"),
            ("mg_levels_pc_type", "pc_type"),
            ("mg_levels_12_ksp_max_it", "ksp_max_it"),
            ("telescope_mg_coarse_sub_pc_type", "pc_type"),
            ("fieldsplit_u_ksp_rtol", "ksp_rtol"),
            ("ksp_ksp_type", "ksp_type"),
            ("mg_levels_esteig_ksp_type", "ksp_type"),
            ("ksp_type", "ksp_type"),
            ("ksp_pc_side", "ksp_pc_side"),
        ] {
            assert_eq!(without_nesting(name), base, "{name}");
        }
    }
}
