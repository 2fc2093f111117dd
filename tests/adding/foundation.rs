//! f_I = Σ_p k_p S_Ip n (n · (x_p - X_p)): points on springs along the unit vector n of an axis
//! (Winkler's foundation), k_p their stiffness in N/m.

use mpm_par::error::Result;
use mpm_par::parallel::World;
use mpm_par::system::in_place::InPlace;
use mpm_par::system::pattern::Pattern;
use mpm_par::system::scatter::{BlockMatrix, BlockRows, add_support};
use mpm_par::system::step_system::Discretisation;
use mpm_par::system::terms::Term;
use mpm_par::system::terms::stress::StepPoints;
use mpm_par::system::terms::term::At;

/// The springs of one step.
pub struct Foundation {
    axis: usize,
    /// Σ k S^T S in its owners' rows, N/m: constant over the step.
    matrix: BlockMatrix<1>,
    /// Force along the axis at the owned nodes at the step's start, N.
    start: Vec<f64>,
}

impl Foundation {
    /// `stiffness`: of the spring of each point, N/m; zero for none. Collective.
    pub fn new<const D: usize>(
        world: &World,
        mesh: &Discretisation<D>,
        step: StepPoints<'_, D>,
        axis: usize,
        stiffness: &[f64],
    ) -> Result<Self> {
        let numbering = &mesh.numbering;
        let mut matrix = BlockMatrix::zeros(&mesh.pattern);
        let mut start = vec![0.0; numbering.len()];
        // The points of a group have their nodes in common: one dense block for them all.
        for group in 0..step.groups.len() {
            let nodes = step.nodes_of_group(group);
            let mut block = vec![0.0; nodes.len() * nodes.len()];
            for &p in step.groups.points(group) {
                let weights = &step.influences.weights[step.influences.row(p)];
                let points = step.points;
                let moved = points.position[p][axis] - points.position_initial[p][axis];
                for (row, (&node, weight)) in
                    block.chunks_exact_mut(nodes.len()).zip(nodes.iter().zip(weights))
                {
                    let share = stiffness[p] * weight;
                    start[node as usize] += share * moved;
                    for (entry, other) in row.iter_mut().zip(weights) {
                        *entry += share * other;
                    }
                }
            }
            add_support(&mut matrix, &mesh.pattern, group, &block);
        }
        // Nodes at the border collect what the points of other ranks add.
        matrix.reduce(world, &mesh.pattern);
        numbering.halo.reverse_add(world, &mut start, 1)?;
        start.truncate(numbering.owned);
        Ok(Foundation { axis, matrix, start })
    }

    /// K u along the axis in an owned row, N.
    fn product<const D: usize>(&self, at: At<'_>, row: usize) -> f64 {
        let entries = at.pattern.offsets[row]..at.pattern.offsets[row + 1];
        let of = |entry: usize| {
            let column = at.pattern.columns[entry] as usize;
            self.matrix.values[entry] * at.displacement[column * D + self.axis]
        };
        entries.map(of).sum()
    }
}

impl<const D: usize> Term<D> for Foundation {
    fn add_force(&self, at: At<'_>, force: &mut [f64]) {
        for (row, start) in self.start.iter().enumerate() {
            force[row * D + self.axis] += start + self.product::<D>(at, row);
        }
    }

    fn add_tangent(&self, pattern: &Pattern, owned: usize, rows: &mut InPlace<'_, D>) {
        for row in 0..owned {
            let entries = pattern.offsets[row]..pattern.offsets[row + 1];
            // A block row is D scalar rows, each with D values per column.
            let line = rows.start(pattern, row) + self.axis * D * entries.len();
            let values = rows.values(line, D * entries.len());
            for (block, entry) in values.chunks_exact_mut(D).zip(entries) {
                block[self.axis] += self.matrix.values[entry];
            }
        }
    }

    fn energy(&self, at: At<'_>) -> f64 {
        let of = |(row, start): (usize, &f64)| {
            at.displacement[row * D + self.axis] * (start + 0.5 * self.product::<D>(at, row))
        };
        self.start.iter().enumerate().map(of).sum()
    }

    fn add_sizes(&self, pattern: &Pattern, moved: &[f64], size: &mut [f64]) {
        for (row, start) in self.start.iter().enumerate() {
            let entries = pattern.offsets[row]..pattern.offsets[row + 1];
            let of = |entry: usize| {
                self.matrix.values[entry].abs() * moved[pattern.columns[entry] as usize]
            };
            size[row] += start.abs() + entries.map(of).sum::<f64>();
        }
    }
}
