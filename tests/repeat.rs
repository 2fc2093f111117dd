//! One system solved many times over by fresh solvers: the solutions are equal bit by bit.

mod common;

use common::on_ranks;
use mpi::topology::SimpleCommunicator;
use mpi::traits::Communicator;
use mpm_par::analysis::solver::Linear;
use mpm_par::petsc::Index;
use mpm_par::petsc::{Ksp, Matrix, Session};

const CELLS: usize = 60;
const NODES: usize = CELLS + 1;

/// Element matrix of plane strain on a unit square (E = 1, nu = 0.3), 2x2 Gauss points.
fn element() -> [[f64; 8]; 8] {
    let (lambda, mu) = (0.3 / (1.3 * 0.4), 0.5 / 1.3);
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let g = 1.0 / 3f64.sqrt();
    let mut k = [[0.0; 8]; 8];
    for (gx, gy) in corners.map(|(x, y): (f64, f64)| (x * g, y * g)) {
        let d: Vec<[f64; 2]> = corners
            .iter()
            .map(|(x, y)| [x * (1.0 + y * gy) / 2.0, y * (1.0 + x * gx) / 2.0])
            .collect();
        for a in 0..4 {
            for b in 0..4 {
                let dot = d[a][0] * d[b][0] + d[a][1] * d[b][1];
                for i in 0..2 {
                    for j in 0..2 {
                        let same = if i == j { mu * dot } else { 0.0 };
                        k[2 * a + i][2 * b + j] +=
                            0.25 * (lambda * d[a][i] * d[b][j] + mu * d[a][j] * d[b][i] + same);
                    }
                }
            }
        }
    }
    k
}

/// Elasticity on a square, clamped at the left by identity rows; this rank's rows in strips.
fn system(comm: &SimpleCommunicator) -> (Matrix, Vec<f64>) {
    let (rank, size) = (comm.rank() as usize, comm.size() as usize);
    let (first, end) = (NODES * rank / size * NODES, NODES * (rank + 1) / size * NODES);
    let k = element();
    let corner = [(0, 0), (1, 0), (1, 1), (0, 1)];
    let (mut offsets, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
    for row in 2 * first..2 * end {
        let (node, i) = (row / 2, row % 2);
        let (x, y) = (node % NODES, node / NODES);
        let mut entries = std::collections::BTreeMap::new();
        for (a, (ax, ay)) in corner.iter().enumerate() {
            let (Some(cx), Some(cy)) = (x.checked_sub(*ax), y.checked_sub(*ay)) else { continue };
            if cx >= CELLS || cy >= CELLS {
                continue;
            }
            for (b, (bx, by)) in corner.iter().enumerate() {
                for j in 0..2 {
                    let column = 2 * ((cy + by) * NODES + cx + bx) + j;
                    let fixed = x == 0 || cx + bx == 0;
                    let value = if !fixed {
                        k[2 * a + i][2 * b + j]
                    } else {
                        f64::from(u8::from(row == column)) / 4.0
                    };
                    *entries.entry(column).or_insert(0.0) += value;
                }
            }
        }
        columns.extend(entries.keys().map(|&c| c as Index));
        values.extend(entries.values());
        offsets.push(columns.len() as Index);
    }
    let n = 2 * (end - first);
    let mut a = Matrix::from_csr(comm, 2, n, &offsets, &columns, &values).unwrap();
    a.set_spd(true).unwrap();
    let positions: Vec<f64> =
        (first..end).flat_map(|node| [(node % NODES) as f64, (node / NODES) as f64]).collect();
    a.set_rigid_body_near_null_space(&positions).unwrap();
    let load = (2 * first..2 * end)
        .map(|row| if row % (2 * NODES) < 2 { 0.0 } else { 1.0 / (1 + row % 17) as f64 })
        .collect();
    (a, load)
}

/// Largest difference between the solutions of `repeats` fresh solvers, over the largest value.
fn spread<V: AsRef<str>>(comm: &SimpleCommunicator, options: &[(&str, V)], repeats: usize) -> f64 {
    let mut first: Option<Vec<f64>> = None;
    let mut largest = 0.0;
    for _ in 0..repeats {
        let (a, load) = system(comm);
        let mut ksp = Ksp::new(comm, "r_").unwrap();
        ksp.set_defaults(options).unwrap();
        ksp.set_from_options().unwrap();
        ksp.set_operators(&a).unwrap();
        let (mut b, mut x) = (a.vector().unwrap(), a.vector().unwrap());
        b.values_mut().unwrap().copy_from_slice(&load);
        ksp.solve(&b, &mut x).unwrap().require("the test").unwrap();
        let mut residual = a.vector().unwrap();
        a.mult(&x, &mut residual).unwrap();
        residual.axpy(-1.0, &b).unwrap();
        assert!(residual.norm().unwrap() < 1e-6 * b.norm().unwrap());
        let scale = x.norm_max().unwrap();
        let values = x.values().unwrap().to_vec();
        let before: &Vec<f64> = first.get_or_insert_with(|| values.clone());
        let own = values.iter().zip(before).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
        let mut difference = a.vector().unwrap();
        difference.set(own / scale).unwrap();
        largest = f64::max(largest, difference.norm_max().unwrap());
    }
    largest
}

#[test]
fn multigrid_repeats_bit_by_bit() {
    on_ranks("multigrid_repeats_bit_by_bit", &[3, 4], |universe| {
        let _session = Session::start(universe, &[], &[]).unwrap();
        let options = [("ksp_type", "cg"), ("pc_type", "gamg"), ("ksp_rtol", "1e-9")];
        assert_eq!(spread(&universe.world(), &options, 8), 0.0);
    });
}

#[test]
fn gathered_factors_repeat_bit_by_bit() {
    on_ranks("gathered_factors_repeat_bit_by_bit", &[1, 3, 4], |universe| {
        let _session = Session::start(universe, &[], &[]).unwrap();
        let world = universe.world();
        let options = Linear::DirectOnOne.options(world.size() as usize, true);
        assert_eq!(spread(&world, &options, 8), 0.0);
    });
}
