//! Exchange, halo, partition and migration on several ranks, more than there are cores.

mod common;

use common::on_ranks;
use mpm_par::error::{Error, Result};
use mpm_par::grid::{Grid, Lattice};
use mpm_par::parallel::exchange::exchange_in_messages;
use mpm_par::parallel::partition::imbalance;
use mpm_par::parallel::{HaloPlan, Partition, World, exchange, migrate};
use mpm_par::points::Points;

const COUNTS: [usize; 5] = [1, 2, 3, 4, 7];

/// Repeatable noise.
fn mix(k: usize) -> usize {
    let mut x = (k as u64).wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    x ^= x >> 29;
    x = x.wrapping_mul(0xBF58_476D_1CE4_E5B9);
    (x ^ (x >> 32)) as usize
}

#[test]
fn reductions_and_failures_reach_all() {
    on_ranks("reductions_and_failures_reach_all", &COUNTS, |universe| {
        let world = World::new(universe.world());
        let (rank, size) = (world.rank(), world.size());
        assert_eq!(world.sum_usize(rank), size * (size - 1) / 2);
        assert_eq!(world.exclusive_sum(rank + 1), rank * (rank + 1) / 2);
        assert_eq!(world.max(rank as f64), (size - 1) as f64);
        assert_eq!(world.min(-(rank as f64)), 1.0 - size as f64);
        assert!(world.max(if rank == size - 1 { f64::NAN } else { 1.0 }).is_nan());
        assert_eq!(world.sum_slice(&[1.0, rank as f64])[0], size as f64);
        assert!(world.any(rank == size - 1) && !world.any(false));
        let mut bytes = vec![rank as u8; rank + 1];
        world.broadcast_bytes(size - 1, &mut bytes);
        assert_eq!(bytes, vec![(size - 1) as u8; size]);

        assert_eq!(world.fail_together(Ok(rank)).unwrap(), rank);
        let outcome: Result<()> =
            if rank + 2 >= size { Err(Error::File(format!("rank {rank}: disk"))) } else { Ok(()) };
        let error = world.fail_together(outcome).unwrap_err();
        assert!(matches!(error, Error::File(_)));
        assert_eq!(error.to_string(), format!("rank {}: disk", size.saturating_sub(2)));
        assert_eq!(imbalance(&world, 0.0), 1.0);
        let mean = (size + 1) as f64 / 2.0;
        assert!((imbalance(&world, (rank + 1) as f64) - size as f64 / mean).abs() < 1e-12);
    });
}

#[test]
fn exchange_delivers_everything_in_order() {
    on_ranks("exchange_delivers_everything_in_order", &COUNTS, |universe| {
        let world = World::new(universe.world());
        let (rank, size) = (world.rank(), world.size());
        // What `a` sends to `b` in a round; often nothing.
        let content = |a: usize, b: usize, round: usize| -> Vec<u64> {
            let length = mix(a + 31 * b + 1000 * round) % 40;
            let length = if length < 15 { 0 } else { length };
            (0..length).map(|k| (a * 1_000_000 + b * 1000 + k + round) as u64).collect()
        };
        // Many rounds without a pause between: a message of one must never end in another.
        for round in 0..200 {
            let outgoing = (0..size).rev().map(|b| (b, content(rank, b, round))).collect();
            let limit = if round % 2 == 0 { 1 << 20 } else { 8 * (1 + round % 5) };
            let incoming = exchange_in_messages(&world, outgoing, limit).unwrap();
            let expected: Vec<(usize, Vec<u64>)> = (0..size)
                .map(|a| (a, content(a, rank, round)))
                .filter(|(_, list)| !list.is_empty())
                .collect();
            assert_eq!(incoming, expected, "round {round}");
        }
        let nothing = exchange::<f64>(&world, Vec::new()).unwrap();
        assert!(nothing.is_empty());
        let wrong = if rank == 0 { vec![(size, vec![1.0])] } else { Vec::new() };
        assert!(exchange(&world, wrong).unwrap_err().to_string().contains("rank"));
    });
}

#[test]
fn halo_copies_and_adds_in_order() {
    on_ranks("halo_copies_and_adds_in_order", &COUNTS, |universe| {
        let world = World::new(universe.world());
        let (rank, size) = (world.rank(), world.size());
        // Key k belongs to rank k % size, at local place k / size; the last rank needs nothing.
        let per_rank = 6;
        let mut ghosts: Vec<(usize, usize)> = (0..per_rank * size)
            .filter(|k| {
                k % size != rank && !mix(k + 100 * rank).is_multiple_of(3) && rank + 1 != size
            })
            .map(|k| (k % size, k))
            .collect();
        ghosts.sort_unstable();
        let local_of = |key: usize| (key % size == rank).then_some(key / size);
        let plan = HaloPlan::build(&world, per_rank, &ghosts, local_of).unwrap();
        for block in [1, 3] {
            let value = |key: usize, c: usize| (10 * key + c) as f64;
            let mut values = vec![-1.0; (per_rank + ghosts.len()) * block];
            for place in 0..per_rank {
                for c in 0..block {
                    values[place * block + c] = value(place * size + rank, c);
                }
            }
            plan.forward(&world, &mut values, block).unwrap();
            for (g, &(_, key)) in ghosts.iter().enumerate() {
                for c in 0..block {
                    assert_eq!(values[(per_rank + g) * block + c], value(key, c));
                }
            }
            // The same while other work goes on, two arrays in one message.
            let mut fields = [values.clone(), values.iter().map(|v| 3.0 * v).collect()];
            for field in &mut fields {
                field[per_rank * block..].fill(-1.0);
            }
            let [one, two] = &mut fields;
            let sum = plan.forward_while(&world, [one, two], block, |[one, _]| {
                one[..per_rank * block].iter().sum::<f64>()
            });
            assert_eq!(sum, values[..per_rank * block].iter().sum::<f64>());
            assert_eq!(fields[0], values);
            assert!(fields[1].iter().zip(&values).all(|(a, b)| *a == 3.0 * b));
            let [mut plain, mut other] = fields.clone();
            plain[..per_rank * block].iter_mut().for_each(|v| *v += 1.0);
            plan.reverse_add(&world, &mut plain, block).unwrap();
            plan.reverse_add(&world, &mut other, block).unwrap();
            let [one, two] = &mut fields;
            plan.reverse_add_while(&world, [one, two], block, |[one, _]| {
                one[..per_rank * block].iter_mut().for_each(|v| *v += 1.0);
            });
            assert_eq!(fields, [plain, other]);
            // Sums whose rounding depends on the order repeat bit by bit.
            let mut first: Option<Vec<f64>> = None;
            for _ in 0..20 {
                let mut values: Vec<f64> =
                    (0..values.len()).map(|i| 1.0 / (3 + i + rank * 7) as f64).collect();
                let before = values.clone();
                plan.reverse_add(&world, &mut values, block).unwrap();
                let (total, was): (f64, f64) =
                    (values[..per_rank * block].iter().sum(), before.iter().sum());
                assert!((world.sum(total) - world.sum(was)).abs() < 1e-12);
                assert_eq!(*first.get_or_insert_with(|| values.clone()), values);
            }
        }
        if size > 1 {
            let nobody = |_| None;
            let ask = if rank == 0 { vec![(1, 5)] } else { Vec::new() };
            let error = HaloPlan::build(&world, 0, &ask, nobody).unwrap_err();
            assert!(error.to_string().contains("node 5"), "{error}");
        }
    });
}

fn lattice(cells: [usize; 2]) -> Grid<2> {
    Grid::Lattice(Lattice { origin: [-1.0, 2.0], spacing: [0.5, 0.25], cells })
}

/// Points at the centres of quarter cells of a disc-like patch; every rank seeds its share.
fn seed(
    world: &World,
    grid: &Grid<2>,
    cells: [usize; 2],
    inside: impl Fn(f64, f64) -> bool,
) -> Points<2> {
    let mut points = Points::default();
    let (low, high) = (grid.node_position(0), grid.node_position(grid.node_count() - 1));
    for k in 0..4 * cells[0] * cells[1] {
        let (i, j) = (k % (2 * cells[0]), k / (2 * cells[0]));
        let (s, t) = ((i as f64 + 0.5) / 2.0, (j as f64 + 0.5) / 2.0);
        if k % world.size() == world.rank() && inside(s, t) {
            let x = [
                low[0] + s / cells[0] as f64 * (high[0] - low[0]),
                low[1] + t / cells[1] as f64 * (high[1] - low[1]),
            ];
            points.push_unstrained(k as u64, 0, x, 0.1, 2.0, [0.1, 0.1]);
            let last = points.len() - 1;
            points.velocity[last] = [k as f64, -1.0];
            points.plastic_strain[last] = mix(k) as f64;
        }
    }
    points
}

/// All ids, on every rank: nothing lost, nothing doubled.
fn all_ids(world: &World, points: &Points<2>) -> Vec<u64> {
    let outgoing = (0..world.size()).map(|rank| (rank, points.id.clone())).collect();
    let mut ids: Vec<u64> =
        exchange(world, outgoing).unwrap().into_iter().flat_map(|(_, list)| list).collect();
    ids.sort_unstable();
    ids
}

fn check_home(world: &World, partition: &Partition<2>, grid: &Grid<2>, points: &Points<2>) {
    let cells: Vec<usize> = points.position.iter().map(|x| grid.locate(x).unwrap()).collect();
    assert!(cells.iter().all(|&c| partition.owner_of_cell(grid, c) == world.rank()));
    let keys: Vec<(usize, u64)> = cells.into_iter().zip(points.id.iter().copied()).collect();
    let strays = keys.windows(2).filter(|pair| pair[0] > pair[1]).count();
    assert!(50 * strays <= keys.len(), "nearly sorted by cell and id");
    for p in 0..points.len() {
        assert_eq!(points.velocity[p], [points.id[p] as f64, -1.0]);
        assert_eq!(points.plastic_strain[p], mix(points.id[p] as usize) as f64);
    }
}

#[test]
fn points_find_their_ranks_and_lose_nothing() {
    on_ranks("points_find_their_ranks_and_lose_nothing", &COUNTS, |universe| {
        let world = World::new(universe.world());
        let cells = [40, 30];
        let grid = lattice(cells);
        let mut points =
            seed(&world, &grid, cells, |s, t| (s - 12.0).powi(2) + (t - 12.0).powi(2) < 100.0);
        let ids = all_ids(&world, &points);
        let partition = Partition::build(&world, &grid, None, &points, None).unwrap();
        let again = Partition::build(&world, &grid, None, &points, None).unwrap();
        assert_eq!(partition.owners(), again.owners());
        migrate(&world, &partition, &grid, &mut points).unwrap();
        check_home(&world, &partition, &grid, &points);
        assert_eq!(all_ids(&world, &points), ids);
        assert!(imbalance(&world, points.len() as f64) < 1.2);
        assert_eq!(migrate(&world, &partition, &grid, &mut points).unwrap(), 0);
        // Every node has an owner, the same on all ranks.
        let owners: Vec<f64> =
            (0..grid.node_count()).map(|n| partition.owner_of_node(&grid, n) as f64).collect();
        let mean: Vec<f64> = owners.iter().map(|o| o * world.size() as f64).collect();
        assert_eq!(world.sum_slice(&owners), mean);

        // A jump across the grid, onto cell boundaries and the grid's upper corner.
        for (p, &id) in points.id.iter().enumerate() {
            let target = mix(id as usize) % grid.node_count();
            points.position[p] = grid.node_position(target);
        }
        let moved = migrate(&world, &partition, &grid, &mut points).unwrap();
        assert_eq!(moved > 0, world.size() > 1);
        check_home(&world, &partition, &grid, &points);
        assert_eq!(all_ids(&world, &points), ids);

        // A new partition levels the load again; the same points give the same answer
        // whichever rank holds them.
        let new = partition.rebuild(&world, &grid, &points, None).unwrap();
        migrate(&world, &new, &grid, &mut points).unwrap();
        check_home(&world, &new, &grid, &points);
        assert!(imbalance(&world, points.len() as f64) < 1.2);
        let same = new.rebuild(&world, &grid, &points, None).unwrap();
        assert_eq!(same.owners(), new.owners());
        let heavy: Vec<f64> =
            points.position.iter().map(|x| if x[0] < 4.0 { 10.0 } else { 1.0 }).collect();
        let weighted = new.rebuild(&world, &grid, &points, Some(&heavy)).unwrap();
        migrate(&world, &weighted, &grid, &mut points).unwrap();
        let cost = points.position.iter().map(|x| if x[0] < 4.0 { 10.0 } else { 1.0 }).sum();
        assert!(imbalance(&world, cost) < 1.2);
        assert_eq!(all_ids(&world, &points), ids);
    });
}

#[test]
fn fewer_bricks_than_ranks_leave_some_without_points() {
    on_ranks("fewer_bricks_than_ranks_leave_some_without_points", &[1, 4, 7], |universe| {
        let world = World::new(universe.world());
        let cells = [8, 8];
        let grid = lattice(cells);
        let mut points = seed(&world, &grid, cells, |s, t| s < 4.0 && t < 8.0);
        let ids = all_ids(&world, &points);
        let partition = Partition::build(&world, &grid, Some(4), &points, None).unwrap();
        migrate(&world, &partition, &grid, &mut points).unwrap();
        check_home(&world, &partition, &grid, &points);
        assert_eq!(all_ids(&world, &points), ids);
        assert_eq!(world.sum_usize(usize::from(!points.is_empty())), world.size().min(2));
        // Nothing at all is no trouble either.
        points.select(&[]);
        let partition = partition.rebuild(&world, &grid, &points, None).unwrap();
        assert_eq!(migrate(&world, &partition, &grid, &mut points).unwrap(), 0);
    });
}

#[test]
fn a_point_outside_the_grid_is_named_on_all_ranks() {
    on_ranks("a_point_outside_the_grid_is_named_on_all_ranks", &[1, 3], |universe| {
        let world = World::new(universe.world());
        let cells = [8, 8];
        let grid = lattice(cells);
        let mut points = seed(&world, &grid, cells, |_, _| true);
        let partition = Partition::build(&world, &grid, None, &points, None).unwrap();
        migrate(&world, &partition, &grid, &mut points).unwrap();
        let ids = all_ids(&world, &points);
        for (x, words) in [([99.0, 2.1], "outside the grid"), ([f64::NAN, 2.1], "not finite")] {
            let mut bad = points.clone();
            if let Some(p) = bad.id.iter().position(|&id| id == 77) {
                bad.position[p] = x;
            }
            let error = migrate(&world, &partition, &grid, &mut bad).unwrap_err();
            assert!(matches!(error, Error::Run(_)));
            let text = error.to_string();
            assert!(text.contains("point 77 ") && text.contains(words), "{text}");
            assert_eq!(all_ids(&world, &bad), ids);
        }
    });
}
