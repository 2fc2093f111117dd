//! The partitioner: METIS on the graph of populated units, with a fallback that cannot fail.

use std::sync::Mutex;

use metis::option::{Seed, UFactor};

use crate::error::{Error, Result};

/// Populated units, numbered 0.. in ascending order of the unit; symmetric adjacency.
#[derive(Debug, Clone, Default)]
pub struct Graph {
    /// Cost of each unit, > 0.
    pub costs: Vec<f64>,
    /// Neighbours of unit u: `offsets[u]..offsets[u + 1]`.
    pub offsets: Vec<i32>,
    pub neighbours: Vec<i32>,
    /// Weight of each adjacency: what is exchanged if it is cut.
    pub contacts: Vec<i32>,
}

/// Sum of the integer weights handed to METIS: fine enough for any cost, far from overflow.
const WEIGHT_TOTAL: f64 = (1u32 << 28) as f64;

/// Part of each unit, `0..parts`; no part is empty if there are as many units as parts, and
/// the same graph always gives the same answer. Error: METIS refused.
pub fn split(graph: &Graph, parts: usize) -> Result<Vec<u32>> {
    let units = graph.costs.len();
    if parts <= 1 {
        return Ok(vec![0; units]);
    }
    if units <= parts {
        return Ok((0..units as u32).collect());
    }
    let total: f64 = graph.costs.iter().sum();
    let weights: Vec<metis::Idx> = graph
        .costs
        .iter()
        .map(|cost| ((cost / total * WEIGHT_TOTAL) as metis::Idx).max(1))
        .collect();
    let mut part = vec![0; units];
    // METIS draws from the process's one random sequence: calls must not interleave.
    static ALONE: Mutex<()> = Mutex::new(());
    let alone = ALONE.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let problem = metis::Graph::new(1, parts as metis::Idx, &graph.offsets, &graph.neighbours)
        .map_err(|error| refused(&error))?
        .set_vwgt(&weights)
        .set_adjwgt(&graph.contacts)
        .set_option(Seed(1));
    // Recursive bisection balances few parts better, k-way is faster for many.
    if parts <= 8 {
        problem.part_recursive(&mut part)
    } else {
        problem.set_option(UFactor(20)).part_kway(&mut part)
    }
    .map_err(|error| refused(&error))?;
    drop(alone);

    let part: Vec<u32> = part.iter().map(|&p| p as u32).collect();
    let mut filled = vec![false; parts];
    part.iter().for_each(|&p| filled[p as usize] = true);
    // With few units a part, METIS may leave parts empty.
    Ok(if filled.iter().all(|&f| f) { part } else { slices(&graph.costs, parts) })
}

/// Consecutive units in shares of about equal cost, none empty. Needs `costs.len() >= parts`.
fn slices(costs: &[f64], parts: usize) -> Vec<u32> {
    let total: f64 = costs.iter().sum();
    let (mut part, mut before) = (0, 0.0);
    let mut first_of_part = 0;
    let mut result = Vec::with_capacity(costs.len());
    for (u, cost) in costs.iter().enumerate() {
        let left = costs.len() - u;
        let full = before + 0.5 * cost > total * (part + 1) as f64 / parts as f64;
        let must = left == parts - part - 1;
        if part + 1 < parts && u > first_of_part && (full || must) {
            part += 1;
            first_of_part = u;
        }
        result.push(part as u32);
        before += cost;
    }
    result
}

fn refused(error: &dyn std::fmt::Display) -> Error {
    Error::Environment(format!("METIS could not partition the units: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid_graph(n: usize, cost: impl Fn(usize) -> f64) -> Graph {
        let mut graph = Graph { offsets: vec![0], ..Graph::default() };
        for u in 0..n * n {
            let (i, j) = (u % n, u / n);
            for (di, dj) in [(0, -1), (-1, 0), (1, 0), (0, 1i32)] {
                let (a, b) = (i as i32 + di, j as i32 + dj);
                if a >= 0 && b >= 0 && a < n as i32 && b < n as i32 {
                    graph.neighbours.push(b * n as i32 + a);
                    graph.contacts.push(1);
                }
            }
            graph.offsets.push(graph.neighbours.len() as i32);
            graph.costs.push(cost(u));
        }
        graph
    }

    #[test]
    fn loads_are_level_and_answers_repeat() {
        let graph = grid_graph(20, |u| 1.0 + (u % 7) as f64);
        for parts in [2, 3, 7, 12] {
            let part = split(&graph, parts).unwrap();
            assert_eq!(part, split(&graph, parts).unwrap());
            let mut loads = vec![0.0; parts];
            part.iter().zip(&graph.costs).for_each(|(&p, c)| loads[p as usize] += c);
            let mean = graph.costs.iter().sum::<f64>() / parts as f64;
            let largest = loads.iter().copied().fold(0.0, f64::max);
            assert!(largest < 1.06 * mean, "{parts} parts: {loads:?}");
        }
    }

    #[test]
    fn few_units_still_fill_the_parts() {
        for units in 2..6 {
            let graph = grid_graph(units, |_| 1.0);
            for parts in 1..=graph.costs.len() {
                let part = split(&graph, parts).unwrap();
                let mut seen: Vec<u32> = part.clone();
                seen.sort_unstable();
                seen.dedup();
                assert_eq!(seen.len(), parts, "{units}^2 units, {parts} parts: {part:?}");
            }
        }
        assert_eq!(split(&grid_graph(1, |_| 2.0), 5).unwrap(), [0]);
    }

    #[test]
    fn slices_fill_every_part() {
        assert_eq!(slices(&[100.0, 1.0, 1.0, 1.0], 3), [0, 1, 2, 2]);
        assert_eq!(slices(&[1.0, 1.0, 1.0, 100.0], 3), [0, 0, 1, 2]);
        assert_eq!(slices(&[1.0; 6], 3), [0, 0, 1, 1, 2, 2]);
    }
}
