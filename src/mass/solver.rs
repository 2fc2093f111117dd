//! PETSc's solvers of the mass: options `-mass_...`.

use crate::error::Result;
use crate::parallel::World;
use crate::petsc::{Ksp, ShellKsp, options};

/// Of the options.
pub const PREFIX: &str = "mass_";
/// Relative residual in the norm of the preconditioner, (r · P^-1 r)^(1/2). That underrates the error
/// where the factor is poor, at nearly empty nodes most; and what is left of each step adds up: with
/// `pic`, in J, with the square of the steps.
const TOLERANCE: &str = "5e-16";
/// In the other norms, which round-off may keep above that.
const TOLERANCE_OF_OTHERS: &str = "1e-14";
/// Iterations; the worst well-posed systems take a few hundred.
const MOST_ITERATIONS: &str = "5000";

/// How a mass is solved, unless the user says otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// The factor is complete: `preonly`.
    ApplyOnce,
    /// Conjugate gradients.
    Iterate,
}

/// The solvers of a run, each made at its first solve.
#[derive(Default)]
pub struct MassSolver {
    /// By way, then for one right-hand side, and for two side by side.
    made: [[Option<ShellKsp>; 2]; 2],
    /// The user leaves method and norm to the program.
    may_apply_once: Option<bool>,
}

impl MassSolver {
    /// The one for so many right-hand sides (1 or 2). Collective.
    pub(super) fn of(&mut self, world: &World, sides: usize, way: Way) -> Result<&mut ShellKsp> {
        let slot = &mut self.made[way as usize][sides - 1];
        Ok(match slot {
            Some(solver) => solver,
            None => slot.insert(ShellKsp::new(petsc_solver(world, PREFIX, "shell", way)?)?),
        })
    }

    /// Whether [`Way::ApplyOnce`] is the program's to choose.
    pub(super) fn may_apply_once(&mut self) -> Result<bool> {
        if let Some(may) = self.may_apply_once {
            return Ok(may);
        }
        let users =
            ["ksp_type", "ksp_norm_type"].map(|name| options::is_users(&format!("{PREFIX}{name}")));
        let [method, norm] = users;
        Ok(*self.may_apply_once.insert(!method? && !norm?))
    }

    /// Drops what belongs to the last matrix. Collective.
    pub(super) fn forget(&mut self, world: &World) -> Result<()> {
        let made = self.made.as_flattened_mut().iter_mut().flatten();
        made.into_iter().try_for_each(|solver| solver.forget(world.comm()))
    }
}

/// A solver with the defaults of the mass; `preconditioner`: unless the user names one. Collective.
pub fn petsc_solver(world: &World, prefix: &str, preconditioner: &str, way: Way) -> Result<Ksp> {
    let mut ksp = Ksp::new(world.comm(), prefix)?;
    ksp.set_defaults(&[("pc_type", preconditioner), ("ksp_max_it", MOST_ITERATIONS)])?;
    if way == Way::ApplyOnce {
        ksp.set_defaults(&[("ksp_type", "preonly"), ("ksp_norm_type", "none")])?;
        ksp.set_from_options()?;
        return Ok(ksp);
    }
    let method = format!("{prefix}ksp_type");
    let cg = !options::is_users(&method)? || options::get(&method)?.as_deref() == Some("cg");
    let tolerance = if cg { TOLERANCE } else { TOLERANCE_OF_OTHERS };
    ksp.set_defaults(&[("ksp_type", "cg"), ("ksp_rtol", tolerance)])?;
    if cg {
        // Right-hand sides are scaled to one in this norm, which may rise before it falls.
        ksp.set_defaults(&[
            ("ksp_norm_type", "natural"),
            ("ksp_atol", TOLERANCE),
            ("ksp_divtol", "1e30"),
        ])?;
    }
    ksp.set_from_options()?;
    Ok(ksp)
}
