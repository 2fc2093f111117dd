//! Levels an existing partition by handing boundary units from loaded parts to their neighbours:
//! few units move, where a new partition would move most of them.

use std::collections::BTreeSet;

use super::metis::Graph;

/// Rounds of flow and hand-over: a part cannot pass on what it has not yet got.
const ROUNDS: usize = 20;
/// Steps and relative residual at which the flow is good enough: units are lumps anyway.
const FLOW_STEPS: usize = 200;
const FLOW_RESIDUAL: f64 = 1e-3;

/// Moves units until no part has more than `target` times the mean cost, or no move helps.
/// Returns largest over mean. The same input gives the same answer.
///
/// The flow between neighbouring parts is the one of least square (Hu, Blake and Emerson,
/// Concurrency 10, 1998): λ_p - λ_q with Laplacian λ = load - mean on the graph of the parts.
pub fn level(graph: &Graph, part: &mut [u32], parts: usize, target: f64) -> f64 {
    let mut state = State::new(graph, part, parts);
    let mut best = (state.largest_over_mean(), part.to_vec());
    for _ in 0..ROUNDS {
        if best.0 <= target {
            break;
        }
        let mut moved = 0;
        for (flow, from, to) in state.flows(graph, part) {
            moved += state.hand_over(graph, part, from, to, flow);
        }
        let now = state.largest_over_mean();
        if now < best.0 {
            best = (now, part.to_vec());
        }
        if moved == 0 {
            break;
        }
    }
    part.copy_from_slice(&best.1);
    best.0
}

/// Weight of the contacts between parts.
pub fn cut(graph: &Graph, part: &[u32]) -> i64 {
    let twice: i64 = (0..part.len())
        .flat_map(|unit| contacts(graph, unit).map(move |other| (unit, other)))
        .filter(|&(unit, (other, _))| part[unit] != part[other])
        .map(|(_, (_, weight))| i64::from(weight))
        .sum();
    twice / 2
}

fn contacts(graph: &Graph, unit: usize) -> impl Iterator<Item = (usize, i32)> + '_ {
    let range = graph.offsets[unit] as usize..graph.offsets[unit + 1] as usize;
    range.map(|k| (graph.neighbours[k] as usize, graph.contacts[k]))
}

/// Loads and units of the parts.
struct State {
    load: Vec<f64>,
    units: Vec<Vec<u32>>,
}

impl State {
    fn new(graph: &Graph, part: &[u32], parts: usize) -> Self {
        let mut state = State { load: vec![0.0; parts], units: vec![Vec::new(); parts] };
        for (unit, &p) in part.iter().enumerate() {
            state.load[p as usize] += graph.costs[unit];
            state.units[p as usize].push(unit as u32);
        }
        state
    }

    fn largest_over_mean(&self) -> f64 {
        let largest = self.load.iter().copied().fold(0.0, f64::max);
        largest * self.load.len() as f64 / self.load.iter().sum::<f64>()
    }

    /// (flow, from, to) between parts in contact, the largest first.
    fn flows(&self, graph: &Graph, part: &[u32]) -> Vec<(f64, usize, usize)> {
        let mut touching = BTreeSet::new();
        for unit in 0..part.len() {
            for (other, _) in contacts(graph, unit) {
                if part[unit] < part[other] {
                    touching.insert((part[unit] as usize, part[other] as usize));
                }
            }
        }
        let pairs: Vec<(usize, usize)> = touching.into_iter().collect();
        let potential = potential(&pairs, &self.load);
        let mut flows: Vec<(f64, usize, usize)> = pairs
            .into_iter()
            .map(|(p, q)| (potential[p] - potential[q], p, q))
            .map(|(flow, p, q)| if flow < 0.0 { (-flow, q, p) } else { (flow, p, q) })
            .collect();
        flows.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        flows
    }

    /// Hands over units of about `wanted` cost, layer by layer, in each layer those first that
    /// touch the taker most and their own part least; returns how many moved.
    fn hand_over(
        &mut self,
        graph: &Graph,
        part: &mut [u32],
        from: usize,
        to: usize,
        wanted: f64,
    ) -> usize {
        let (mut given, mut moved) = (0.0, 0);
        loop {
            let mut layer = 0;
            for unit in offers(graph, part, &self.units[from], from as u32, to as u32) {
                let cost = graph.costs[unit as usize];
                if given + 0.5 * cost <= wanted {
                    given += cost;
                    layer += 1;
                    part[unit as usize] = to as u32;
                    self.units[to].push(unit);
                }
            }
            if layer == 0 {
                break;
            }
            moved += layer;
            self.units[from].retain(|&unit| part[unit as usize] as usize == from);
        }
        self.load[from] -= given;
        self.load[to] += given;
        moved
    }
}

/// Units of `from` that touch `to`, in the order in which they shorten the cut.
fn offers(graph: &Graph, part: &[u32], units: &[u32], from: u32, to: u32) -> Vec<u32> {
    let mut offers: Vec<(i32, u32)> = Vec::new();
    for &unit in units {
        let (mut gain, mut touches) = (0, false);
        for (other, weight) in contacts(graph, unit as usize) {
            if part[other] == to {
                touches = true;
                gain += weight;
            } else if part[other] == from {
                gain -= weight;
            }
        }
        if touches {
            offers.push((-gain, unit));
        }
    }
    offers.sort_unstable();
    offers.into_iter().map(|(_, unit)| unit).collect()
}

/// λ of Laplacian λ = load - mean, the mean being that of the parts that hang together, by
/// conjugate gradients.
fn potential(pairs: &[(usize, usize)], load: &[f64]) -> Vec<f64> {
    let parts = load.len();
    let mut group: Vec<usize> = (0..parts).collect();
    fn root(group: &mut [usize], mut p: usize) -> usize {
        while group[p] != p {
            group[p] = group[group[p]];
            p = group[p];
        }
        p
    }
    for &(p, q) in pairs {
        let (a, b) = (root(&mut group, p), root(&mut group, q));
        group[a.max(b)] = a.min(b);
    }
    let (mut sum, mut count) = (vec![0.0; parts], vec![0.0; parts]);
    for p in 0..parts {
        let r = root(&mut group, p);
        sum[r] += load[p];
        count[r] += 1.0;
    }
    let mut residual: Vec<f64> = (0..parts)
        .map(|p| {
            let r = root(&mut group, p);
            load[p] - sum[r] / count[r]
        })
        .collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut solution = vec![0.0; parts];
    let mut direction = residual.clone();
    let start = dot(&residual, &residual);
    let mut norm = start;
    for _ in 0..FLOW_STEPS {
        if norm <= FLOW_RESIDUAL * FLOW_RESIDUAL * start {
            break;
        }
        let mut image = vec![0.0; parts];
        for &(p, q) in pairs {
            let slope = direction[p] - direction[q];
            image[p] += slope;
            image[q] -= slope;
        }
        let curvature = dot(&direction, &image);
        if curvature <= 0.0 {
            break;
        }
        let step = norm / curvature;
        for p in 0..parts {
            solution[p] += step * direction[p];
            residual[p] -= step * image[p];
        }
        let next = dot(&residual, &residual);
        let keep = next / norm;
        direction.iter_mut().zip(&residual).for_each(|(d, r)| *d = r + keep * *d);
        norm = next;
    }
    solution
}

#[cfg(test)]
mod tests {
    use super::*;

    /// n x n units with contacts along x and y.
    fn square(n: usize, cost: impl Fn(usize, usize) -> f64) -> Graph {
        let mut graph = Graph { offsets: vec![0], ..Graph::default() };
        for unit in 0..n * n {
            let (i, j) = (unit % n, unit / n);
            for (di, dj) in [(0, -1), (-1, 0), (1, 0), (0, 1)] {
                let (a, b) = (i as i32 + di, j as i32 + dj);
                if a >= 0 && b >= 0 && a < n as i32 && b < n as i32 {
                    graph.neighbours.push(b * n as i32 + a);
                    graph.contacts.push(1);
                }
            }
            graph.offsets.push(graph.neighbours.len() as i32);
            graph.costs.push(cost(i, j));
        }
        graph
    }

    #[test]
    fn a_small_excess_is_levelled_by_a_small_move() {
        let n = 24;
        // Columns of equal width; the first part is a quarter dearer.
        let graph = square(n, |i, _| if i < n / 4 { 1.25 } else { 1.0 });
        let old: Vec<u32> = (0..n * n).map(|u| (u % n / (n / 4)) as u32).collect();
        let mut part = old.clone();
        let largest = level(&graph, &mut part, 4, 1.03);
        assert!(largest <= 1.03, "{largest}");
        let moved = part.iter().zip(&old).filter(|(a, b)| a != b).count();
        assert!(moved < n * n / 5, "{moved} of {}", n * n);
        assert!(cut(&graph, &part) < 2 * cut(&graph, &old));
        let mut again = old.clone();
        level(&graph, &mut again, 4, 1.03);
        assert_eq!(again, part);
    }

    #[test]
    fn load_travels_through_a_chain_of_parts() {
        let n = 24;
        let graph = square(n, |_, _| 1.0);
        // Part 0 has three quarters, the others thin columns at the far side.
        let mut part: Vec<u32> =
            (0..n * n).map(|u| ((u % n).saturating_sub(16) / 2) as u32).collect();
        let largest = level(&graph, &mut part, 4, 1.05);
        assert!(largest <= 1.05, "{largest}");
        assert!(cut(&graph, &part) <= 3 * n as i64 + 12, "{}", cut(&graph, &part));
    }

    #[test]
    fn the_flow_of_a_chain_is_the_only_one_there_is() {
        // Loads 8, 0, 0, 0 on a chain: 6, 4 and 2 have to pass.
        let lambda = potential(&[(0, 1), (1, 2), (2, 3)], &[8.0, 0.0, 0.0, 0.0]);
        for (p, flow) in [6.0, 4.0, 2.0].into_iter().enumerate() {
            assert!((lambda[p] - lambda[p + 1] - flow).abs() < 0.05, "{lambda:?}");
        }
        // Parts that do not hang together level among themselves.
        let lambda = potential(&[(0, 1)], &[4.0, 2.0, 50.0]);
        assert!((lambda[0] - lambda[1] - 1.0).abs() < 1e-9 && lambda[2] == 0.0, "{lambda:?}");
    }

    #[test]
    fn a_part_without_contact_gets_nothing_and_nothing_hangs() {
        let graph = square(4, |_, _| 1.0);
        let mut part = vec![0; 16];
        assert_eq!(level(&graph, &mut part, 3, 1.05), 3.0);
        assert_eq!(part, [0; 16]);
        assert_eq!(cut(&graph, &part), 0);
    }

    #[test]
    fn one_dear_unit_stays() {
        let graph = square(4, |i, j| if i + j == 0 { 100.0 } else { 1.0 });
        let mut part: Vec<u32> = (0..16).map(|u| u32::from(u % 4 >= 2)).collect();
        let largest = level(&graph, &mut part, 2, 1.05);
        assert_eq!(part[0], 0);
        assert!((largest - 100.0 / 57.5).abs() < 1e-12, "{largest}: {part:?}");
    }
}
