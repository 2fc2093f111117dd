//! One product with the matrix of a square or a cube, every node coupled to those around it:
//! compressed rows in double precision, row by row; blocks in single precision; half of these. On
//! one core, and on two at once, each with a matrix of its own, as two ranks have.

use std::sync::Barrier;
use std::time::Instant;

use mpm_par::blocks::{Blocks, Half};

/// Unknowns a node, nodes a side, cells that couple.
type Case = (&'static str, usize, [usize; 3], usize);

/// In and out of a third-level cache of 32 MiB.
const CASES: [Case; 10] = [
    ("2D, 9", 2, [252, 252, 1], 1),
    ("2D, 9", 2, [1000, 1000, 1], 1),
    ("2D, 25", 2, [200, 200, 1], 2),
    ("2D, 25", 2, [500, 500, 1], 2),
    ("2D coarse, 9", 3, [140, 140, 1], 1),
    ("2D coarse, 9", 3, [500, 500, 1], 1),
    ("3D, 27", 3, [32, 32, 32], 1),
    ("3D, 27", 3, [56, 56, 56], 1),
    ("3D, 125", 3, [18, 18, 18], 2),
    ("3D, 125", 3, [32, 32, 32], 2),
];

/// Kinds of work: rows, blocks, half, plain forms of both, half in double precision.
const KINDS: usize = 6;
const ROUNDS: usize = 20;

pub fn products() {
    println!("\nleast of {ROUNDS} rounds in turn, ms and GB/s by wall time");
    println!(
        "| matrix, neighbours | nodes | MB of blocks | rows | blocks | half | gain | plain | \
         plain half | double half | two at once: rows | blocks | half | gain | double half |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for (name, block, side, reach) in CASES {
        let (offsets, columns) = neighbours(block, side, reach);
        let [one, two] = [1, 2].map(|cores| least(cores, block, &offsets, &columns));
        let megabytes = |per_entry: f64| columns.len() as f64 * per_entry * 1e-6;
        let per = 4.0 + 4.0 / (block * block) as f64;
        let rates = |times: &[f64; KINDS], cores: f64| {
            [(0, 12.0), (1, per), (2, per / 2.0)].map(|(kind, bytes)| {
                let rate = cores * megabytes(bytes) / times[kind] * 1e-3;
                format!("{:.2}, {rate:.0}", 1e3 * times[kind])
            })
        };
        println!(
            "| {name} | {} | {:.0} | {} | {:.2} | {} | {} | {:.2} | {:.2} |",
            side.iter().product::<usize>(),
            megabytes(per),
            rates(&one, 1.0).join(" | "),
            one[1] / one[2],
            one[3..].iter().map(|t| format!("{:.2}", 1e3 * t)).collect::<Vec<_>>().join(" | "),
            rates(&two, 2.0).join(" | "),
            two[1] / two[2],
            1e3 * two[5]
        );
    }
}

/// In blocks, half of them, and half in double precision.
fn kept<const K: usize>(
    offsets: &[i32],
    columns: &[i32],
    values: &[f64],
) -> (Blocks<f32>, Half<f32>, Half<f64>) {
    let count = columns.len() / (K * K);
    let room = "blocks with a kernel";
    let mut blocks = Blocks::growing([K, K], count).expect(room);
    let mut half = Half::growing(K, count / 2).expect(room);
    let mut exact = Half::growing(K, count / 2).expect(room);
    let mut row = Vec::new();
    for first in (0..offsets.len() - 1).step_by(K) {
        let (start, end) = (offsets[first] as usize, offsets[first + 1] as usize);
        row.clear();
        row.extend((0..(end - start) / K).map(|k| {
            let at = |r: usize, c: usize| values[offsets[first + r] as usize + k * K + c];
            let block: [[f64; K]; K] = std::array::from_fn(|r| std::array::from_fn(|c| at(r, c)));
            (columns[start + k * K] as usize / K, block)
        }));
        blocks.push(&row);
        half.push(&row);
        exact.push(&row);
    }
    (blocks.finish(), half, exact)
}

/// Seconds of each kind of work on `cores` cores at once, each on its own copy: of the slowest in
/// a round, the least of all rounds.
fn least(cores: usize, block: usize, offsets: &[i32], columns: &[i32]) -> [f64; KINDS] {
    let start = Barrier::new(cores);
    let work = || {
        let (offsets, columns) = (offsets.to_vec(), columns.to_vec());
        let values: Vec<f64> = (0..columns.len()).map(|k| (k % 101) as f64 - 50.0).collect();
        let x: Vec<f64> = (1..offsets.len()).map(|k| (k % 13) as f64).collect();
        let mut y = vec![0.0; x.len()];
        let (blocks, half, exact) = if block == 2 {
            kept::<2>(&offsets, &columns, &values)
        } else {
            kept::<3>(&offsets, &columns, &values)
        };
        let mut round = || {
            let mut act = |kind: usize| match kind {
                0 => multiply_rows(&offsets, &columns, &values, &x, &mut y),
                1 => blocks.multiply(&x, &mut y),
                2 => half.multiply(&x, &mut y),
                3 => blocks.multiply_plain(&x, &mut y),
                4 => half.multiply_plain(&x, &mut y),
                _ => exact.multiply(&x, &mut y),
            };
            std::array::from_fn(|kind| {
                start.wait();
                let begin = Instant::now();
                act(kind);
                begin.elapsed().as_secs_f64()
            })
        };
        (0..ROUNDS).map(|_| round()).collect()
    };
    let all: Vec<Vec<[f64; KINDS]>> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..cores).map(|_| scope.spawn(work)).collect();
        threads.into_iter().map(|thread| thread.join().expect("a round ends")).collect()
    });
    std::array::from_fn(|kind| {
        let slowest = |round: usize| all.iter().map(|core| core[round][kind]).fold(0.0, f64::max);
        (0..ROUNDS).map(slowest).fold(f64::INFINITY, f64::min)
    })
}

fn multiply_rows(offsets: &[i32], columns: &[i32], values: &[f64], x: &[f64], y: &mut [f64]) {
    for (y, row) in y.iter_mut().zip(offsets.windows(2)) {
        let row = row[0] as usize..row[1] as usize;
        let terms = values[row.clone()].iter().zip(&columns[row]);
        *y = terms.map(|(value, &column)| value * x[column as usize]).sum();
    }
}

/// Compressed rows of `block` unknowns at each node of a lattice, coupled to all nodes within
/// `reach` cells.
fn neighbours(block: usize, side: [usize; 3], reach: usize) -> (Vec<i32>, Vec<i32>) {
    let (mut offsets, mut columns) = (vec![0], Vec::new());
    let around = |k: usize, n: usize| k.saturating_sub(reach)..=(k + reach).min(n - 1);
    for node in 0..side.iter().product() {
        let place = [node % side[0], node / side[0] % side[1], node / (side[0] * side[1])];
        for _ in 0..block {
            for k in around(place[2], side[2]) {
                for j in around(place[1], side[1]) {
                    for i in around(place[0], side[0]) {
                        let first = block * ((k * side[1] + j) * side[0] + i);
                        columns.extend((first..first + block).map(|column| column as i32));
                    }
                }
            }
            offsets.push(columns.len() as i32);
        }
    }
    (offsets, columns)
}
