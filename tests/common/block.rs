//! Made-up equations of an elastic or flowing block, dealt out to ranks.
#![allow(dead_code)]

use mpm_par::amg::level::{BlockCsr, Nodes};
use mpm_par::parallel::{HaloPlan, World};
use mpm_par::petsc::Index;

/// A block of `cells` bilinear or trilinear elements of side 1, E = 1, nu = 0.3.
#[derive(Clone, Copy)]
pub struct Block<const D: usize> {
    pub cells: [usize; D],
    /// All of its nodes with x = 0 are held, or none.
    pub held: bool,
    /// The elements of a band across the block flow like sand, which makes K unsymmetric.
    pub flow: bool,
}

/// Slopes of a Drucker-Prager cone and of its plastic potential, and the plastic modulus over 2 mu.
const FRICTION: f64 = 0.5;
const DILATION: f64 = 0.1;
const HARDENING: f64 = 0.5;

/// This rank's share of its equations.
pub struct Share<const D: usize> {
    pub nodes: Nodes,
    pub rows: BlockCsr<D>,
}

impl<const D: usize> Block<D> {
    pub fn count(&self) -> usize {
        self.cells.iter().map(|n| n + 1).product()
    }

    fn place(&self, mut node: usize) -> [usize; D] {
        self.cells.map(|n| {
            let index = node % (n + 1);
            node /= n + 1;
            index
        })
    }

    /// Nodes around one, itself included, ascending.
    pub fn around(&self, node: usize) -> Vec<usize> {
        let place = self.place(node);
        let mut nodes = vec![0];
        for axis in (0..D).rev() {
            let range = place[axis].saturating_sub(1)..=(place[axis] + 1).min(self.cells[axis]);
            nodes = nodes
                .iter()
                .flat_map(|&n| range.clone().map(move |k| n * (self.cells[axis] + 1) + k))
                .collect();
        }
        nodes
    }

    /// K_ab of two nodes: the sum over the elements that have both.
    pub fn stiffness(&self, a: usize, b: usize) -> [[f64; D]; D] {
        let (lambda, mu) = (0.3 / (1.3 * 0.4), 1.0 / 2.6);
        let (p, q) = (self.place(a), self.place(b));
        let mut block = [[0.0; D]; D];
        for cell in 0..1 << D {
            // The element's lower corner, seen from a.
            let corner: [isize; D] =
                std::array::from_fn(|k| p[k] as isize - ((cell >> k) & 1) as isize);
            let inside = |k: usize| (0..self.cells[k] as isize).contains(&corner[k]);
            let local = |place: &[usize; D]| -> Option<[usize; D]> {
                let offset: [isize; D] = std::array::from_fn(|k| place[k] as isize - corner[k]);
                let fits = offset.iter().all(|k| (0..2).contains(k));
                fits.then(|| offset.map(|k| k as usize))
            };
            let (Some(i), Some(j), true) = (local(&p), local(&q), (0..D).all(inside)) else {
                continue;
            };
            let flow = self.flow(corner);
            for point in 0..1 << D {
                let x: [f64; D] = std::array::from_fn(|k| {
                    0.5 + (((point >> k) & 1) as f64 - 0.5) / 3.0f64.sqrt()
                });
                let (da, db) = (gradient(i, x), gradient(j, x));
                let dot: f64 = (0..D).map(|k| da[k] * db[k]).sum();
                for r in 0..D {
                    for s in 0..D {
                        let term = lambda * da[r] * db[s] + mu * da[s] * db[r];
                        let same = if r == s { mu * dot } else { 0.0 };
                        block[r][s] += (term + same) / f64::from(1u32 << D);
                        if let Some([out, by]) = &flow {
                            let left: f64 = (0..D).map(|k| out[r][k] * da[k]).sum();
                            let right: f64 = (0..D).map(|k| by[s][k] * db[k]).sum();
                            block[r][s] -= left * right / f64::from(1u32 << D);
                        }
                    }
                }
            }
        }
        if self.held && (p[0] == 0 || q[0] == 0) {
            let one = if a == b { 1.0 } else { 0.0 };
            block =
                std::array::from_fn(|r| std::array::from_fn(|s| if r == s { one } else { 0.0 }));
        }
        block
    }

    /// Of an element that flows, the two factors of the rank-one term that its moduli lose: C : N and
    /// C : M over the root of M : C : N + H, with N = n + DILATION 1, M = n + FRICTION 1 and n a
    /// shear of size 1 whose direction turns over the block.
    fn flow(&self, corner: [isize; D]) -> Option<[[[f64; D]; D]; 2]> {
        let at: [f64; D] = std::array::from_fn(|k| (corner[k] as f64 + 0.5) / self.cells[k] as f64);
        if !self.flow || (at[0] - at[1]).abs() > 0.25 {
            return None;
        }
        let (lambda, mu) = (0.3 / (1.3 * 0.4), 1.0 / 2.6);
        let bulk = D as f64 * lambda + 2.0 * mu;
        let scale = 2.0 * mu * (1.0 + HARDENING) + bulk * FRICTION * DILATION * D as f64;
        let (sin, cos) = (3.0 * at[0] + 2.0 * at[1]).sin_cos();
        let half = 0.5f64.sqrt();
        let shear = |r: usize, s: usize| match (r, s) {
            (0, 0) => half * cos,
            (1, 1) => -half * cos,
            (0, 1) | (1, 0) => half * sin,
            _ => 0.0,
        };
        let factor = |slope: f64| {
            std::array::from_fn(|r| {
                std::array::from_fn(|s| {
                    let volume = if r == s { bulk * slope } else { 0.0 };
                    (2.0 * mu * shear(r, s) + volume) / scale.sqrt()
                })
            })
        };
        Some([factor(DILATION), factor(FRICTION)])
    }

    /// Nodes in consecutive shares; of more than two ranks the second has none.
    pub fn share(&self, world: &World) -> Share<D> {
        let workers: Vec<usize> =
            (0..world.size()).filter(|&rank| world.size() < 3 || rank != 1).collect();
        let begin = |rank: usize| {
            let before = workers.iter().filter(|&&worker| worker < rank).count();
            self.count() * before / workers.len()
        };
        let own = begin(world.rank())..begin(world.rank() + 1);
        let owner = |node: usize| {
            *workers.iter().find(|&&rank| node < begin(rank + 1)).expect("a node of the block")
        };
        let mut ghosts: Vec<(usize, usize)> = own
            .clone()
            .flat_map(|node| self.around(node))
            .filter(|node| !own.contains(node))
            .map(|node| (owner(node), node))
            .collect();
        ghosts.sort_unstable();
        ghosts.dedup();
        let global: Vec<Index> =
            own.clone().chain(ghosts.iter().map(|g| g.1)).map(|node| node as Index).collect();
        let local = |node: usize| {
            let ghost = || own.len() + ghosts.partition_point(|g| g.1 < node);
            if own.contains(&node) { node - own.start } else { ghost() }
        };
        let mut rows = BlockCsr { offsets: vec![0], columns: Vec::new(), values: Vec::new() };
        for node in own.clone() {
            for other in self.around(node) {
                rows.columns.push(local(other) as u32);
                rows.values.push(self.stiffness(node, other));
            }
            rows.offsets.push(rows.columns.len());
        }
        let halo = HaloPlan::build(world, own.len(), &ghosts, |node| {
            own.contains(&node).then(|| node - own.start)
        });
        let position = |&node: &Index| {
            let place = self.place(node as usize);
            std::array::from_fn(|k| place.get(k).map_or(0.0, |&n| n as f64))
        };
        let key = |&node: &Index| (node as f64 * 0.618_033_988_749_895).fract() + 1e-9;
        let nodes = Nodes {
            owned: own.len(),
            position: global.iter().map(position).collect(),
            key: global.iter().map(key).collect(),
            global,
            halo: halo.unwrap(),
            ..Nodes::default()
        };
        Share { nodes, rows }
    }
}

/// Gradient of the shape function of an element's corner.
fn gradient<const D: usize>(corner: [usize; D], x: [f64; D]) -> [f64; D] {
    let value = |k: usize| if corner[k] == 1 { x[k] } else { 1.0 - x[k] };
    std::array::from_fn(|axis| {
        let sign = if corner[axis] == 1 { 1.0 } else { -1.0 };
        (0..D).filter(|&k| k != axis).map(value).product::<f64>() * sign
    })
}
