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

/// The solvers of a run, made at the first solve: for one right-hand side, and for two side by side.
#[derive(Default)]
pub struct MassSolver([Option<ShellKsp>; 2]);

impl MassSolver {
    /// The one for so many right-hand sides (1 or 2). Collective.
    pub(super) fn of(&mut self, world: &World, sides: usize) -> Result<&mut ShellKsp> {
        let slot = &mut self.0[sides - 1];
        Ok(match slot {
            Some(solver) => solver,
            None => slot.insert(ShellKsp::new(petsc_solver(world, PREFIX, "shell")?)?),
        })
    }

    /// Drops what belongs to the last matrix. Collective.
    pub(super) fn forget(&mut self, world: &World) -> Result<()> {
        self.0.iter_mut().flatten().try_for_each(|solver| solver.forget(world.comm()))
    }
}

/// A solver with the defaults of the mass; `preconditioner`: unless the user names one. Collective.
pub fn petsc_solver(world: &World, prefix: &str, preconditioner: &str) -> Result<Ksp> {
    let mut ksp = Ksp::new(world.comm(), prefix)?;
    let method = format!("{prefix}ksp_type");
    let cg = !options::is_users(&method)? || options::get(&method)?.as_deref() == Some("cg");
    ksp.set_defaults(&[
        ("ksp_type", "cg"),
        ("pc_type", preconditioner),
        ("ksp_max_it", MOST_ITERATIONS),
        ("ksp_rtol", if cg { TOLERANCE } else { TOLERANCE_OF_OTHERS }),
    ])?;
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
