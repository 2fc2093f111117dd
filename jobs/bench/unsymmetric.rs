//! Iterations of the linear solvers on a block that flows like sand in a band, and on the elastic
//! one: conjugate gradients, FGMRES and BCGSL with multigrid on the symmetric part, over the mesh
//! size. The rank count is that of `mpirun`.
//!
//! `cargo build --benches`, then `mpirun -n RANKS target/.../unsymmetric-*`. Iterations per linear
//! solve, to 1e-8. BCGSL multiplies twice in an iteration.

#[path = "../../tests/common/block.rs"]
mod block;
#[path = "../../tests/common/hardening.rs"]
mod hardening;

use block::Block;
use hardening::solve_under;
use mpi::traits::Communicator;
use mpm_par::parallel::World;
use mpm_par::petsc::Session;

fn main() {
    let (universe, _) = mpi::initialize_with_threading(mpi::Threading::Funneled)
        .expect("MPI was not started before");
    let _session = Session::start(&universe, &[], &[]).expect("PETSc starts");
    let world = World::new(universe.world().duplicate());
    if world.rank() == 0 {
        println!("ranks,cells,equations,cg elastic,fgmres elastic,fgmres flow,bcgsl flow");
    }
    for n in [32, 64, 128, 256] {
        row(&world, Block { cells: [n, n], held: true, flow: true });
    }
    for n in [8, 16, 32] {
        row(&world, Block { cells: [n, n, n], held: true, flow: true });
    }
}

/// So small that the equations are linear.
const LOAD: f64 = 1e-7;

fn row<const D: usize>(world: &World, block: Block<D>) {
    let elastic = Block { flow: false, ..block };
    let name = block.cells.map(|n| n.to_string()).join("x");
    let of = |method: &str, block: Block<D>, symmetric: bool| -> String {
        let options = [("ksp_type", method), ("ksp_rtol", "1e-8"), ("ksp_gmres_restart", "100")];
        let prefix = format!("{method}_{}_{name}_", block.flow);
        let solved = solve_under(world, block, &prefix, &options, true, symmetric, LOAD);
        solved.map_or_else(
            |error| error.to_string(),
            |solved| format!("{:.1}", solved.linear as f64 / solved.newton as f64),
        )
    };
    let counts = [
        of("cg", elastic, true),
        of("fgmres", elastic, false),
        of("fgmres", block, false),
        of("bcgsl", block, false),
    ];
    if world.rank() == 0 {
        let equations = block.count() * D;
        println!("{},{name},{equations},{}", world.size(), counts.join(","));
    }
}
