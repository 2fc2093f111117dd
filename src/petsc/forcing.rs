//! eta_k = gamma (|b_k| / |b_k-1|)^alpha: how well the k-th linear solve of Newton's method is
//! worth doing (Eisenstat & Walker 1996, choice 2, with Kelley's safeguards).
//!
//! PETSc has the rule too, behind hooks before and after its linear solver. Those hooks are ours:
//! they put prescribed displacements on the right-hand side b, whose norm is therefore the one to
//! compare. The parameters are kept by PETSc, under its names (`-snes_ksp_ew_gamma`, ...).

use std::ptr::{null, null_mut};

use super::check::{petsc, text_of};
use super::{options, sys};
use crate::error::{Error, Result};

/// Share of the error still allowed that a linear solve may leave.
const REMAINDER: f64 = 1e-2;

/// The rule and where it stands within one nonlinear solve.
#[derive(Debug, Clone, PartialEq)]
pub struct Forcing {
    /// eta_0.
    pub first: f64,
    /// Most that a tolerance may be.
    pub largest: f64,
    /// Smallest: what a solve with fixed tolerance would take.
    pub smallest: f64,
    /// Factor of the rule.
    pub gamma: f64,
    /// Exponent of the rule.
    pub alpha: f64,
    /// gamma eta^alpha of the last solve counts only above this.
    pub threshold: f64,
    /// |b| and eta of the last solve.
    last: Option<(f64, f64)>,
}

impl Forcing {
    /// Tighter than PETSc's choice (0.3, 0.9, 1, 1.6): the noise that a solve leaves decides now and
    /// then whether an iterate just passes, so that the count of evaluations and with it the answer
    /// would depend on the number of ranks (docs/evidence/performance.md has the measurements).
    pub fn new(smallest: f64) -> Self {
        Forcing {
            first: 1e-3,
            largest: 1e-3,
            smallest,
            gamma: 1e-2,
            alpha: 2.0,
            threshold: 0.1,
            last: None,
        }
    }

    /// The relative tolerance of the next solve. `norm`: of its right-hand side; `error_over_tolerance`: the
    /// error before it over the error that is enough. A tolerance below the inverse of that ratio is idle.
    pub fn next(&mut self, norm: f64, error_over_tolerance: f64) -> f64 {
        let rule = match self.last {
            None => self.first,
            Some((before, eta)) => {
                let rule = self.gamma * (norm / before).powf(self.alpha);
                let kept = self.gamma * eta.powf(self.alpha);
                let rule = if kept > self.threshold { rule.max(kept) } else { rule };
                rule.max(REMAINDER / error_over_tolerance)
            }
        };
        // Both also take the place of what is not a number.
        let eta = rule.min(self.largest).max(self.smallest);
        self.last = Some((norm, eta));
        eta
    }
}

/// Makes the rule the default of `snes`; call before its options are read.
pub(crate) fn set_default(snes: sys::SNES) -> Result<()> {
    let rule = Forcing::new(0.0);
    petsc!(SNESKSPSetUseEW(snes, sys::PETSC_TRUE))?;
    petsc!(SNESKSPSetParametersEW(
        snes,
        2,
        rule.first,
        rule.largest,
        rule.gamma,
        rule.alpha,
        rule.alpha,
        rule.threshold
    ))
}

/// Methods that can judge their residual as the nonlinear solver does, without preconditioner.
const TRUE_NORM: [&str; 4] = ["cg", "gmres", "fgmres", "bcgs"];

/// The rule that the options ask for, if the linear solver iterates. A `ksp_rtol` given by the
/// user is a fixed tolerance, unless `snes_ksp_ew` is given too. PETSc's own rule is off from here on:
/// newer versions have hooks of their own for it, and would set their tolerances over ours.
pub(crate) fn chosen(snes: sys::SNES, prefix: &str) -> Result<Option<Forcing>> {
    let used = petsc!(SNESKSPGetUseEW(snes) -> sys::PETSC_FALSE)?;
    petsc!(SNESKSPSetUseEW(snes, sys::PETSC_FALSE))?;
    let inner = petsc!(SNESGetKSP(snes) -> null_mut())?;
    let fixed = options::is_users(&format!("{prefix}ksp_rtol"))?
        && !options::is_users(&format!("{prefix}snes_ksp_ew"))?;
    let kind = text_of(petsc!(KSPGetType(inner) -> null())?);
    if used == sys::PETSC_FALSE || fixed || kind == "preonly" {
        return Ok(None);
    }
    let (mut version, mut first, mut largest, mut gamma) = (0, 0.0, 0.0, 0.0);
    let (mut alpha, mut unused, mut threshold) = (0.0, 0.0, 0.0);
    petsc!(SNESKSPGetParametersEW(
        snes,
        &mut version,
        &mut first,
        &mut largest,
        &mut gamma,
        &mut alpha,
        &mut unused,
        &mut threshold
    ))?;
    if version != 2 {
        return Err(Error::Input(format!(
            "-{prefix}snes_ksp_ew_version {version} is not available: the only rule is 2"
        )));
    }
    let free = !options::is_users(&format!("{prefix}ksp_norm_type"))?
        && !options::is_users(&format!("{prefix}ksp_pc_side"))?;
    if free && TRUE_NORM.contains(&kind.as_str()) {
        petsc!(KSPSetNormType(inner, sys::KSP_NORM_UNPRECONDITIONED))?;
    }
    let mut smallest = 0.0;
    petsc!(KSPGetTolerances(inner, &mut smallest, null_mut(), null_mut(), null_mut()))?;
    Ok(Some(Forcing { first, largest, smallest, gamma, alpha, threshold, last: None }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tolerances_follow_the_rule_and_its_safeguards() {
        let mut rule = Forcing { first: 0.5, largest: 0.9, gamma: 0.8, ..Forcing::new(1e-8) };
        let far = f64::INFINITY;
        assert_eq!(rule.next(10.0, far), 0.5);
        // 0.8 (4/10)^2 = 0.128, but 0.8 0.5^2 = 0.2 is above the threshold.
        assert!((rule.next(4.0, far) - 0.2).abs() < 1e-15);
        // 0.8 0.2^2 = 0.032 is not.
        assert!((rule.next(0.4, far) - 0.008).abs() < 1e-15);
        // A residual that rises asks for no more than the largest.
        assert_eq!(rule.next(4.0, far), 0.9);
        // 0.8 0.9^2 = 0.648; then the floors: what is enough, and the tolerance of the solver.
        assert!((rule.next(4e-3, far) - 0.648).abs() < 1e-15);
        rule.threshold = 0.99;
        assert!((rule.next(4e-6, 40.0) - REMAINDER / 40.0).abs() < 1e-15);
        assert_eq!(rule.next(4e-12, far), 1e-8);
        assert_eq!(rule.next(0.0, f64::NAN), 1e-8);
        // 0/0 says nothing.
        assert_eq!(rule.next(0.0, far), 1e-8);
    }
}
