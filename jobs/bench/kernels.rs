//! Nanoseconds per point of each part of a step, on one core, beside the machine's limits.
//!
//! `cargo bench --bench kernels [-- WORDS]`: the cases whose names hold one of the words; `size`:
//! cost against size; `limits`: larger cases, phase by phase beside what the machine would need.

mod counts;
mod limits;
mod report;

use std::hint::black_box;
use std::path::Path;

use counts::Numbers;
use limits::Machine;
use mpm_par::analysis::equilibrium::{Equilibrium, NewtonSettings, StepEquations, motion};
use mpm_par::analysis::solver;
use mpm_par::error::Result;
use mpm_par::mechanics::displacement_gradient;
use mpm_par::mechanics::{self, StepStart};
use mpm_par::parallel::World;
use mpm_par::petsc::Session;
use mpm_par::petsc::snes::NewtonProblem;
use mpm_par::points::Points;
use mpm_par::run::setup;
use mpm_par::system::conditions::{Conditions, StepSpan};
use mpm_par::system::model::Model;
use mpm_par::system::numbering::Numbering;
use mpm_par::system::scatter::BlockMatrix;
use mpm_par::system::step_system::Discretisation;
use mpm_par::system::terms::declaration::Context;
use mpm_par::system::terms::stress;
use mpm_par::system::unknowns::Unknowns;
use mpm_par::transfer::update;
use mpm_par::{basis, deck};
use report::{Sample, machine, resident_bytes, sample, sample_parts};

/// Newton iterations a step takes on the average: shares the cost of what runs once per step.
const ITERATIONS_PER_STEP: f64 = 4.0;
const SPAN: StepSpan =
    StepSpan { stage: 0, factor_start: 0.0, factor_end: 1.0, time_start: 0.0, time_end: 0.0 };

struct Case {
    name: &'static str,
    dimension: usize,
    basis: &'static str,
    plastic: bool,
    /// Cells per side of the block of material.
    cells: usize,
    per_cell: usize,
}

const CASES: [Case; 6] = [
    Case {
        name: "2d-gimp-elastic",
        dimension: 2,
        basis: "gimp",
        plastic: false,
        cells: 100,
        per_cell: 2,
    },
    Case {
        name: "2d-gimp-plastic",
        dimension: 2,
        basis: "gimp",
        plastic: true,
        cells: 100,
        per_cell: 2,
    },
    Case {
        name: "3d-mpm-elastic",
        dimension: 3,
        basis: "mpm",
        plastic: false,
        cells: 17,
        per_cell: 2,
    },
    Case {
        name: "3d-mpm-plastic",
        dimension: 3,
        basis: "mpm",
        plastic: true,
        cells: 17,
        per_cell: 2,
    },
    Case {
        name: "3d-gimp-elastic",
        dimension: 3,
        basis: "gimp",
        plastic: false,
        cells: 13,
        per_cell: 2,
    },
    Case {
        name: "3d-gimp-plastic",
        dimension: 3,
        basis: "gimp",
        plastic: true,
        cells: 13,
        per_cell: 2,
    },
];

/// Cost against size: 2D gimp, elastic, 1e4 to 1e6 points.
const SIZES: [usize; 3] = [50, 158, 500];

/// Cells per side of the cases held against the machine's limits: their systems fill no cache.
const LARGE: [(usize, &str, usize); 3] = [(2, "gimp", 350), (3, "mpm", 40), (3, "gimp", 28)];

impl Case {
    /// A block of material away from the grid's edges, its points off the cells' middles by
    /// 0.13 h, so that domains cross grid lines as often as they do after some steps.
    fn deck(&self) -> String {
        let Case { dimension, basis, cells, per_cell, .. } = self;
        let list = |value: f64| format!("{:?}", vec![value; *dimension]);
        let material =
            if self.plastic { "model = \"von-mises\"\nyield = 1e3" } else { "model = \"hencky\"" };
        format!(
            "title = \"{}\"\n[analysis]\ntype = \"quasi-static\"\nsteps = 1\n\
             [method]\nbasis = \"{basis}\"\n\
             [ghost]\nstiffness_factor = 1.0\n\
             [grid]\ntype = \"lattice\"\norigin = {}\nsize = {}\nh = 1.0\n\
             [material.m]\n{material}\nyoung = 1e6\npoisson = 0.3\n\
             [[body]]\nname = \"block\"\nmaterial = \"m\"\ndensity = 1.0\n\
             shape = {{ box = {{ min = {}, max = {} }} }}\npoints_per_cell = {:?}\n\
             [[boundary]]\nname = \"low\"\nwhere = {{ box = {{ min = {}, max = {} }} }}\n\
             fix = {}\n[[load]]\ngravity = {}\n[output]\nevery = 1\nfields = [\"stress\"]\n",
            self.name,
            list(-2.0),
            list(*cells as f64 + 4.0),
            list(0.0),
            list(*cells as f64),
            vec![*per_cell; *dimension],
            list(-2.0),
            list(1.0),
            if *dimension == 2 { "[\"x\", \"y\"]" } else { "[\"x\", \"y\", \"z\"]" },
            list(-1.0),
        )
    }
}

/// Nanoseconds per point of every part of one case.
struct Costs {
    points: usize,
    nodes_per_point: f64,
    bytes_per_point: f64,
    bytes_per_node: f64,
    basis: Sample,
    system: Sample,
    contribution: Sample,
    assemble: Sample,
    evaluate: Sample,
    /// Per step: the empty matrix, and what the equations prepare.
    matrix: Sample,
    force: Sample,
    conditions: Sample,
    product: Sample,
    update: Sample,
    numbers: Numbers,
}

impl Costs {
    /// Everything but the linear solve, per Newton iteration.
    fn per_iteration(&self) -> f64 {
        self.evaluate.median
            + self.conditions.median
            + (self.system.median + self.update.median) / ITERATIONS_PER_STEP
    }
}

fn main() {
    let words: Vec<String> =
        std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let wanted = |name: &str| words.is_empty() || words.iter().any(|word| name.contains(word));
    let (universe, _) = mpi::initialize_with_threading(mpi::Threading::Funneled).expect("MPI");
    let _session = Session::start(&universe, &[], &[]).expect("PETSc");
    let world = World::new(universe.world());

    println!("machine: {}", machine());
    let machine = limits::measured();
    println!(
        "\nns per point, median (least) of {} runs; basis, system, update: per step",
        report::RUNS
    );
    println!(
        "| case | points | nodes each | basis | system | stress + tangent | assembly | evaluation | \
         force alone | conditions | update | matrix | all but the solve, per iteration |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for case in CASES.iter().filter(|case| wanted(case.name)) {
        row(case.name, &costs(&world, case));
    }
    if wanted("size") {
        println!("\ncost against size, 2D gimp, elastic; memory as resident bytes gained");
        for cells in SIZES {
            let costs = costs(&world, &elastic("size", 2, "gimp", cells));
            row("size", &costs);
            println!(
                "  memory: {:.0} bytes per point, {:.0} bytes per active node (system)",
                costs.bytes_per_point, costs.bytes_per_node
            );
        }
    }
    if wanted("limits") {
        println!("\nbeside the machine's limits: least ns, bytes and operations per point");
        counts::print_head();
        for (dimension, basis, cells) in LARGE {
            let name = format!("{dimension}D {basis}");
            print_limits(
                &name,
                &costs(&world, &elastic("limits", dimension, basis, cells)),
                &machine,
            );
        }
    }
}

fn elastic(name: &'static str, dimension: usize, basis: &'static str, cells: usize) -> Case {
    Case { name, dimension, basis, plastic: false, cells, per_cell: 2 }
}

fn print_limits(case: &str, c: &Costs, machine: &Machine) {
    let numbers = &c.numbers;
    println!(
        "  {case}: {} points; per point {:.2} nodes, {:.3} groups, {:.2} places, {:.3} cells, {:.3} \
         active nodes, {:.2} blocks",
        c.points,
        numbers.nodes,
        numbers.groups,
        numbers.places,
        numbers.cells,
        numbers.active,
        numbers.blocks
    );
    for (count, sample) in [
        (numbers.basis(), c.basis),
        (numbers.system(), c.system),
        (numbers.contribution(), c.contribution),
        (numbers.evaluation(), c.evaluate),
        (numbers.product(), c.product),
        (numbers.update(), c.update),
    ] {
        counts::print(case, &count, sample.least, machine);
    }
}

fn row(name: &str, c: &Costs) {
    println!(
        "| {name} | {} | {:.2} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {:.0} |",
        c.points,
        c.nodes_per_point,
        c.basis,
        c.system,
        c.contribution,
        c.assemble,
        c.evaluate,
        c.force,
        c.conditions,
        c.update,
        c.matrix,
        c.per_iteration()
    );
}

fn costs(world: &World, case: &Case) -> Costs {
    let measured = match case.dimension {
        2 => measure::<2>(world, case),
        _ => measure::<3>(world, case),
    };
    measured.expect("the case runs")
}

fn measure<const D: usize>(world: &World, case: &Case) -> Result<Costs> {
    let deck = deck::read(Path::new("bench.toml"), &case.deck(), &[])?;
    let before = resident_bytes();
    let (mut model, mut points) = setup::prepare::<D>(world, deck)?;
    let bytes_points = resident_bytes() - before;
    shift(world, &mut model, &mut points)?;
    let count = points.len();

    let basis_cost = sample(count, || {
        black_box(basis::map_points(&model.grid, model.deck.method.basis, &points).is_ok());
    });
    let system = sample(count, || {
        black_box(Discretisation::new(world, &model, &points).is_ok());
    });
    let before = resident_bytes();
    let mesh = Discretisation::new(world, &model, &points)?;
    let conditions = Conditions::evaluate(
        world,
        &model.grid,
        model.deck.method.basis,
        &mesh.numbering,
        &points,
        (&model.deck.boundaries, Unknowns::<D>::displacements()),
        SPAN,
    )?;
    let numbering = &mesh.numbering;
    let displacement = field(&model, numbering);
    let step = mesh.step_points(&points, &model.materials);
    let frame = model.deck.method.frame;

    let increments: Vec<[[f64; D]; D]> = (0..count)
        .map(|p| {
            let row = mesh.influences.row(p);
            let nodes = &mesh.influences.nodes[row.clone()];
            displacement_gradient(&mesh.influences.gradients[row.clone()], |a| {
                let local = numbering.local(nodes[a]).expect("active");
                std::array::from_fn(|i| displacement[local * D + i])
            })
        })
        .collect();
    let contribution = sample(count, || {
        let mut sum = 0.0;
        for p in 0..count {
            let start = StepStart {
                material: mpm_par::material::local(&model.materials, &points, p),
                state: &[],
                deformation_gradient: &points.deformation_gradient[p],
                elastic_excess: &points.elastic_excess[p],
                volume_initial: points.volume_initial[p],
            };
            let (made, state) = mechanics::contribution::<D>(frame, &start, &increments[p]);
            sum += black_box(&made).volume + black_box(&state).plastic_increment;
        }
        black_box(sum);
    });

    let mut force = vec![0.0; numbering.len() * D];
    let mut stiffness = BlockMatrix::<D>::zeros(&mesh.pattern);
    let assemble = sample(count, || {
        let sound = stress::assemble(
            step,
            frame,
            numbering,
            &mesh.pattern,
            &displacement,
            &mut force,
            Some(&mut stiffness),
        );
        assert!(black_box(sound).is_sound());
    });
    drop(stiffness);

    let settings = NewtonSettings {
        tolerance: 1e-9,
        max_evaluations: 10,
        inverted: model.deck.analysis.inverted_iterates,
        ends_where_stalled: false,
    };
    let left_out = mesh.nodes_left_out(world, model.deck.method.drop_below);
    let owned = numbering.owned * D;
    let (of, unknowns) = ((numbering, &mesh.pattern), Unknowns::displacements());
    let empty = || solver::matrix(world, &model.grid, of, unknowns, true);
    let equations = || -> Result<_> {
        let context = Context::new(world, &model, (&mesh, step.points), SPAN);
        let terms = motion::terms(context, (frame, true), Vec::new())?;
        let equations = StepEquations {
            unknowns,
            conditions: &conditions,
            left_out: &left_out,
            external_owned: vec![0.0; owned],
            terms,
            following: None,
        };
        Ok(Equilibrium::<D>::new(world, &model.grid, &mesh, equations, settings))
    };
    let matrix_cost = sample(count, || {
        black_box((empty().is_ok(), equations().is_ok()));
    });
    let (mut problem, mut matrix) = (equations()?, empty()?);
    let mut f = vec![0.0; owned];
    let [evaluate, conditioned, force] = sample_parts(count, |part| {
        let x = &displacement[..owned];
        match part {
            0 => {
                let sound = problem.residual(x, &mut f, &mut matrix);
                assert!(sound.is_ok_and(|sound| sound));
            }
            1 => problem.jacobian(x, &mut matrix).expect("the matrix has its pattern"),
            _ => assert!(problem.evaluate_at(x, &mut f, None).is_ok_and(|sound| sound)),
        }
    });
    let (mut x, mut y) = (matrix.vector()?, matrix.vector()?);
    x.values_mut()?.copy_from_slice(&displacement[..owned]);
    let product = sample(count, || matrix.mult(&x, &mut y).expect("sizes fit"));
    let bytes_system = resident_bytes() - before;
    drop(problem);

    let mut copies: Vec<Points<D>> = (0..=report::RUNS).map(|_| points.clone()).collect();
    let update = sample(count, || {
        let made = update::increments(step, &displacement);
        let mut moved = copies.pop().expect("one copy a run");
        update::apply(&model, numbering, &displacement, &made, &mut moved, None)
            .expect("the increments are sound");
        black_box(&moved);
    });
    Ok(Costs {
        points: count,
        nodes_per_point: mesh.influences.nodes.len() as f64 / count as f64,
        bytes_per_point: bytes_points / count as f64,
        bytes_per_node: bytes_system / numbering.len() as f64,
        basis: basis_cost,
        system,
        contribution,
        assemble,
        evaluate,
        matrix: matrix_cost,
        force,
        conditions: conditioned,
        product,
        update,
        numbers: numbers(case, &mesh),
    })
}

/// What the counts are made from.
fn numbers<const D: usize>(case: &Case, mesh: &Discretisation<D>) -> Numbers {
    let per_point = |count: usize| count as f64 / mesh.influences.len() as f64;
    let groups = &mesh.groups;
    let squares = |lengths: &mut dyn Iterator<Item = usize>| lengths.map(|n| n * n).sum::<usize>();
    let points = &mut (0..mesh.influences.len()).map(|p| mesh.influences.row(p).len());
    let all_groups = &mut (0..groups.len()).map(|g| groups.nodes(g).len());
    Numbers {
        dimension: D,
        gimp: case.basis == "gimp",
        plastic: case.plastic,
        nodes: per_point(mesh.influences.nodes.len()),
        pairs: per_point(squares(points)),
        groups: per_point(groups.len()),
        group_nodes: per_point(groups.nodes.len()),
        group_pairs: per_point(squares(all_groups)),
        places: per_point(mesh.pattern.support_columns.len()),
        cells: per_point(mesh.populated.reached.len()),
        active: per_point(mesh.numbering.len()),
        blocks: per_point(mesh.pattern.columns.len()),
    }
}

/// Moves all points by 0.13 h along each axis.
fn shift<const D: usize>(
    world: &World,
    model: &mut Model<D>,
    points: &mut Points<D>,
) -> Result<()> {
    for x in &mut points.position {
        for x in x {
            *x += 0.13;
        }
    }
    mpm_par::parallel::migrate(world, &model.partition, &model.grid, points).map(drop)
}

/// A smooth displacement with strains of some per cent, different along each axis.
fn field<const D: usize>(model: &Model<D>, numbering: &Numbering) -> Vec<f64> {
    numbering
        .nodes
        .iter()
        .flat_map(|&node| {
            let x = model.grid.node_position(node);
            std::array::from_fn::<f64, D, _>(|i| {
                0.02 * x[i] + 0.03 * (0.5 * x[(i + 1) % D]).sin() + 0.01 * (i as f64)
            })
        })
        .collect()
}
