//! f_int(u) + K_G u = f_ext, solved by Newton's method (Lagrangian eq. 26-30, Ghost eq. 25-27).
//!
//! The bookkeeping is the papers': reactions are accumulated from the linear solves, start at
//! zero in each step, and the error is |f_ext - f_int + f_react| / |f_ext + f_react| over all
//! degrees of freedom (Lagrangian eq. 40). Iteration 0 evaluates at zero displacement.

use std::time::Instant;

use crate::assembly::conditions::Conditions;
use crate::assembly::internal::{self, Health, StepPoints};
use crate::assembly::{BlockMatrix, Numbering, Pattern, mass};
use crate::deck::model::{Frame, InvertedIterates};
use crate::error::Result;
use crate::parallel::World;
use crate::petsc::matrix::Matrix;
use crate::petsc::snes::{NewtonProblem, Verdict};
use crate::points::Points;

use super::discretise::Discretisation;

/// Limits and choices of the iteration.
#[derive(Debug, Clone, Copy)]
pub struct NewtonSettings {
    pub tolerance: f64,
    /// Evaluations, the one at zero displacement included.
    pub max_evaluations: usize,
    pub frame: Frame,
    pub inverted: InvertedIterates,
}

/// One step's equations. Vectors named `*_owned` hold the owned degrees of freedom, the others
/// the local ones (owned, then ghosts).
pub struct Equilibrium<'a, const D: usize> {
    world: &'a World,
    numbering: &'a Numbering,
    pattern: &'a Pattern,
    step: StepPoints<'a, D>,
    settings: NewtonSettings,
    /// Fixed by a condition, or left out (`drop_below`).
    held: Vec<bool>,
    increment: Vec<f64>,
    external_owned: Vec<f64>,
    /// K_G: constant over the step.
    ghost: Option<BlockMatrix<1>>,
    inertia: Option<Inertia>,
    stiffness: BlockMatrix<D>,
    /// Tangent rows of held degrees of freedom at the previous iterate.
    held_rows: HeldRows,
    displacement: Vec<f64>,
    previous_owned: Vec<f64>,
    internal_owned: Vec<f64>,
    internal_previous: Vec<f64>,
    internal_start: Vec<f64>,
    reaction_owned: Vec<f64>,
    diagonal_scale: f64,
    /// Normalised error of each evaluation that was accepted.
    pub errors: Vec<f64>,
    /// Health of the last evaluation on this rank.
    pub health: Health,
    /// Wall time of all evaluations, s.
    pub assembly_seconds: f64,
}

/// Inertia that moves with the increments u: the equations become
/// share (f_int(u) + K_G u) + matrix u = f_ext.
#[derive(Debug)]
pub struct Inertia {
    /// 1 + alpha of the HHT method, 1 for Newmark's.
    pub share: f64,
    /// M~ / (beta dt^2) in its owners' rows, kg/s2.
    pub matrix: BlockMatrix<1>,
}

#[derive(Default)]
struct HeldRows {
    rows: Vec<u32>,
    values: Vec<f64>,
}

impl<'a, const D: usize> Equilibrium<'a, D> {
    pub fn new(
        world: &'a World,
        mesh: &'a Discretisation<D>,
        step: StepPoints<'a, D>,
        conditions: &Conditions,
        left_out: &[bool],
        external_owned: Vec<f64>,
        settings: NewtonSettings,
    ) -> Result<Self> {
        let (numbering, pattern) = (&mesh.numbering, &mesh.pattern);
        let mut held = conditions.fixed.clone();
        let increment = conditions.increment.clone();
        for (local, _) in left_out.iter().enumerate().filter(|(_, out)| **out) {
            // A prescribed motion stays: the gradient may see a node whose weight vanishes.
            held[local * D..(local + 1) * D].fill(true);
        }
        let owned = numbering.owned * D;
        let held_rows = HeldRows {
            rows: (0..owned).filter(|&dof| conditions.fixed[dof]).map(|d| d as u32).collect(),
            values: Vec::new(),
        };
        let ghost = ghost_matrix(world, mesh, |face| face.stiffness)?;
        Ok(Equilibrium {
            world,
            numbering,
            pattern,
            step,
            settings,
            held,
            increment,
            external_owned,
            ghost,
            inertia: None,
            stiffness: BlockMatrix::zeros(pattern),
            held_rows,
            displacement: vec![0.0; numbering.len() * D],
            previous_owned: vec![0.0; owned],
            internal_owned: vec![0.0; owned],
            internal_previous: vec![0.0; owned],
            internal_start: Vec::new(),
            assembly_seconds: 0.0,
            reaction_owned: vec![0.0; owned],
            diagonal_scale: 0.0,
            errors: Vec::new(),
            health: Health::default(),
        })
    }

    /// The same equations of a body that has mass.
    pub fn with_inertia(mut self, inertia: Inertia) -> Self {
        self.inertia = Some(inertia);
        self
    }

    pub fn settings(&self) -> &NewtonSettings {
        &self.settings
    }

    /// Forgets all iterates: the next evaluation is the step's first.
    pub fn restart(&mut self) {
        for values in [
            &mut self.previous_owned,
            &mut self.internal_previous,
            &mut self.reaction_owned,
            &mut self.internal_owned,
        ] {
            values.fill(0.0);
        }
        self.diagonal_scale = 0.0;
        self.errors.clear();
    }

    /// Nodal increments of the last evaluation, local nodes.
    pub fn displacement(&self) -> &[f64] {
        &self.displacement
    }

    /// f_int + K_G u of the last evaluation, owned nodes.
    pub fn internal_force(&self) -> &[f64] {
        &self.internal_owned
    }

    /// The same at zero displacement.
    pub fn internal_force_at_start(&self) -> &[f64] {
        &self.internal_start
    }

    /// The point that made the last evaluation unusable, if this rank has one.
    pub fn refused_point(&self, points: &Points<D>) -> Option<String> {
        let name = |p: usize| format!("point {} at {:?}", points.id[p], points.position[p]);
        match (self.health.not_finite, self.health.inverted, self.settings.inverted) {
            (Some(p), _, _) => Some(format!("{} has a stress that is not finite", name(p))),
            (None, Some(p), InvertedIterates::Reject) => Some(format!(
                "{} is turned inside out; smaller steps, Ghost stiffness or \
                 analysis.inverted_iterates = \"allow\" may help",
                name(p)
            )),
            _ => None,
        }
    }

    /// Energy of the Ghost term, u K_G u / 2, this rank's share, J.
    pub fn ghost_energy(&self) -> f64 {
        let Some(ghost) = &self.ghost else { return 0.0 };
        let mut force = vec![0.0; self.numbering.owned * D];
        add_product::<D>(ghost, self.pattern, &self.displacement, &mut force);
        0.5 * force.iter().zip(&self.displacement).map(|(f, u)| f * u).sum::<f64>()
    }

    fn load_displacement(&mut self, x: &[f64]) -> Result<()> {
        self.displacement[..x.len()].copy_from_slice(x);
        self.numbering.halo.forward(self.world, &mut self.displacement, D)
    }

    /// Evaluates force and tangent at the loaded displacement; false if it must be refused.
    fn evaluate(&mut self) -> Result<bool> {
        self.stiffness.values.fill(0.0);
        if let Some(ghost) = &self.ghost {
            add_scalar(ghost, self.pattern, &mut self.stiffness);
        }
        let mut force = vec![0.0; self.numbering.len() * D];
        self.health = internal::assemble(
            self.step,
            self.settings.frame,
            self.numbering,
            self.pattern,
            &self.displacement,
            &mut force,
            Some(&mut self.stiffness),
        )?;
        let refuse = !self.health.is_sound()
            || (self.settings.inverted == InvertedIterates::Reject
                && self.health.inverted.is_some());
        if self.world.any(refuse) {
            return Ok(false);
        }
        self.numbering.halo.reverse_add(self.world, &mut force, D)?;
        force.truncate(self.numbering.owned * D);
        if let Some(ghost) = &self.ghost {
            add_product::<D>(ghost, self.pattern, &self.displacement, &mut force);
        }
        self.stiffness.reduce(self.world, self.pattern)?;
        if let Some(inertia) = &self.inertia {
            for value in force.iter_mut().chain(&mut self.stiffness.values) {
                *value *= inertia.share;
            }
            add_product::<D>(&inertia.matrix, self.pattern, &self.displacement, &mut force);
            add_scalar(&inertia.matrix, self.pattern, &mut self.stiffness);
        }
        self.internal_owned = force;
        Ok(true)
    }

    /// Values of the constrained matrix in compressed rows: held rows and columns become the
    /// identity, scaled like the other diagonal entries so that smoothers see one scale.
    pub fn constrained_values(&self) -> Vec<f64> {
        let end = self.pattern.ghost_start * D * D;
        let mut values = self.stiffness.values[..end].to_vec();
        for row in 0..self.numbering.owned {
            let range = self.pattern.offsets[row]..self.pattern.offsets[row + 1];
            let width = range.len();
            for i in 0..D {
                let dof = row * D + i;
                let start = D * D * range.start + i * width * D;
                for (position, &column) in self.pattern.columns[range.clone()].iter().enumerate() {
                    for k in 0..D {
                        let other = column as usize * D + k;
                        if self.held[dof] || self.held[other] {
                            values[start + position * D + k] =
                                if dof == other { self.diagonal_scale } else { 0.0 };
                        }
                    }
                }
            }
        }
        values
    }

    /// Mean size of the free diagonal entries over all ranks; 1 where there are none.
    fn mean_diagonal(&self) -> f64 {
        let (mut sum, mut count) = (0.0, 0usize);
        for row in 0..self.numbering.owned {
            let range = self.pattern.offsets[row]..self.pattern.offsets[row + 1];
            let Some(position) = self.pattern.find(self.numbering, row, row) else { continue };
            for i in 0..D {
                if !self.held[row * D + i] {
                    let start = D * D * range.start + i * range.len() * D;
                    sum += self.stiffness.values[start + (position - range.start) * D + i].abs();
                    count += 1;
                }
            }
        }
        let (sum, count) = (self.world.sum(sum), self.world.sum_usize(count));
        if count > 0 && sum > 0.0 { sum / count as f64 } else { 1.0 }
    }

    /// Saves K's rows of the fixed degrees of freedom: the reactions of the coming solve.
    fn save_held_rows(&mut self) {
        self.held_rows.values.clear();
        for &dof in &self.held_rows.rows {
            let (row, i) = (dof as usize / D, dof as usize % D);
            let range = self.pattern.offsets[row]..self.pattern.offsets[row + 1];
            let start = D * D * range.start + i * range.len() * D;
            let values = &self.stiffness.values[start..start + range.len() * D];
            self.held_rows.values.extend_from_slice(values);
        }
    }

    /// f_react = f_int(old) + K (x - x_old) - f_ext on the fixed degrees of freedom.
    fn accumulate_reactions(&mut self, x: &[f64]) -> Result<()> {
        let mut change = vec![0.0; self.numbering.len() * D];
        for (c, (new, old)) in change.iter_mut().zip(x.iter().zip(&self.previous_owned)) {
            *c = new - old;
        }
        self.numbering.halo.forward(self.world, &mut change, D)?;
        let mut entry = 0;
        for &dof in &self.held_rows.rows {
            let dof = dof as usize;
            let row = dof / D;
            let mut sum = 0.0;
            for &column in
                &self.pattern.columns[self.pattern.offsets[row]..self.pattern.offsets[row + 1]]
            {
                for k in 0..D {
                    sum += self.held_rows.values[entry] * change[column as usize * D + k];
                    entry += 1;
                }
            }
            self.reaction_owned[dof] = self.internal_previous[dof] + sum - self.external_owned[dof];
        }
        Ok(())
    }

    /// Lagrangian eq. 40. Degrees of freedom left out carry no equation and do not count.
    fn normalised_error(&self) -> f64 {
        let (mut residual, mut actions) = (0.0, 0.0);
        let mut next_fixed = self.held_rows.rows.iter().peekable();
        for dof in 0..self.external_owned.len() {
            let fixed = next_fixed.next_if(|&&row| row as usize == dof).is_some();
            if self.held[dof] && !fixed {
                continue;
            }
            let action = self.external_owned[dof] + self.reaction_owned[dof];
            residual += (action - self.internal_owned[dof]).powi(2);
            actions += action * action;
        }
        let sums = self.world.sum_slice(&[residual, actions]);
        sums[0].sqrt() / (sums[1].sqrt() + f64::EPSILON)
    }
}

impl<const D: usize> NewtonProblem for Equilibrium<'_, D> {
    fn residual(&mut self, x: &[f64], f: &mut [f64]) -> Result<bool> {
        let begin = Instant::now();
        self.load_displacement(x)?;
        let usable = self.evaluate()?;
        self.assembly_seconds += begin.elapsed().as_secs_f64();
        if !usable {
            return Ok(false);
        }
        if self.diagonal_scale == 0.0 {
            self.diagonal_scale = self.mean_diagonal();
        }
        for dof in 0..f.len() {
            f[dof] = if self.held[dof] {
                self.diagonal_scale * (x[dof] - self.increment[dof])
            } else {
                self.internal_owned[dof] - self.external_owned[dof]
            };
        }
        Ok(true)
    }

    fn jacobian(&mut self, _x: &[f64], matrix: &mut Matrix) -> Result<()> {
        // The tangent was assembled with the residual of the same iterate.
        self.save_held_rows();
        matrix.update(&self.constrained_values())
    }

    /// Moves the columns of prescribed displacements to the right-hand side.
    fn before_solve(&mut self, rhs: &mut [f64]) -> Result<()> {
        let mut prescribed = vec![0.0; self.numbering.len() * D];
        let mut any = false;
        for (dof, value) in rhs.iter().enumerate() {
            if self.held[dof] && *value != 0.0 {
                prescribed[dof] = value / self.diagonal_scale;
                any = true;
            }
        }
        if !self.world.any(any) {
            return Ok(());
        }
        self.numbering.halo.forward(self.world, &mut prescribed, D)?;
        for row in 0..self.numbering.owned {
            let range = self.pattern.offsets[row]..self.pattern.offsets[row + 1];
            for i in 0..D {
                let dof = row * D + i;
                if self.held[dof] {
                    continue;
                }
                let start = D * D * range.start + i * range.len() * D;
                for (position, &column) in self.pattern.columns[range.clone()].iter().enumerate() {
                    for k in 0..D {
                        rhs[dof] -= self.stiffness.values[start + position * D + k]
                            * prescribed[column as usize * D + k];
                    }
                }
            }
        }
        Ok(())
    }

    fn assess(&mut self, iteration: usize, x: &[f64], _f: &[f64]) -> Result<Verdict> {
        if iteration > 0 {
            self.accumulate_reactions(x)?;
        } else {
            self.internal_start.clone_from(&self.internal_owned);
        }
        let error = self.normalised_error();
        self.errors.push(error);
        self.previous_owned.copy_from_slice(x);
        self.internal_previous.copy_from_slice(&self.internal_owned);
        Ok(if !error.is_finite() {
            Verdict::Diverged("the residual is not finite".into())
        } else if iteration > 0 && error <= self.settings.tolerance {
            Verdict::Converged
        } else if iteration + 1 >= self.settings.max_evaluations {
            Verdict::Diverged(format!(
                "residual {error:.3e} after {} evaluations, tolerance {:.1e}",
                iteration + 1,
                self.settings.tolerance
            ))
        } else {
            Verdict::Continue
        })
    }

    fn excess(&self) -> f64 {
        self.errors.last().map_or(f64::INFINITY, |error| error / self.settings.tolerance)
    }
}

/// The faces' share of a scalar matrix, `weight(face) * J_G`; `None` if it vanishes everywhere.
pub fn ghost_matrix<const D: usize>(
    world: &World,
    mesh: &Discretisation<D>,
    weight: impl Fn(&crate::ghost::FaceStencil) -> f64,
) -> Result<Option<BlockMatrix<1>>> {
    if !world.any(mesh.faces.iter().any(|face| weight(face) != 0.0)) {
        return Ok(None);
    }
    let mut matrix = BlockMatrix::zeros(&mesh.pattern);
    // Supports of the faces follow those of the groups.
    for (support, face) in (mesh.groups.len()..).zip(&mesh.faces) {
        let factor = weight(face);
        let block: Vec<f64> = face.matrix.iter().map(|value| factor * value).collect();
        mass::add_support(&mut matrix, &mesh.pattern, support, &block);
    }
    matrix.reduce(world, &mesh.pattern)?;
    Ok(Some(matrix))
}

/// Adds J ⊗ 1 to the owned rows.
pub fn add_scalar<const D: usize>(
    scalar: &BlockMatrix<1>,
    pattern: &Pattern,
    matrix: &mut BlockMatrix<D>,
) {
    for range in pattern.offsets.windows(2).map(|pair| pair[0]..pair[1]) {
        if range.start >= pattern.ghost_start {
            break;
        }
        let width = range.len();
        for i in 0..D {
            let start = D * D * range.start + i * width * D;
            for position in 0..width {
                matrix.values[start + position * D + i] += scalar.values[range.start + position];
            }
        }
    }
}

/// force += (J ⊗ 1) u over the owned rows.
fn add_product<const D: usize>(
    scalar: &BlockMatrix<1>,
    pattern: &Pattern,
    displacement: &[f64],
    force: &mut [f64],
) {
    for row in 0..force.len() / D {
        for entry in pattern.offsets[row]..pattern.offsets[row + 1] {
            let (value, column) = (scalar.values[entry], pattern.columns[entry] as usize);
            for i in 0..D {
                force[row * D + i] += value * displacement[column * D + i];
            }
        }
    }
}
