//! Bytes and operations of each phase of a step, counted per point by formulas from what a run knows
//! of itself, beside what the machine would need for them.
//!
//! Bytes: each array counted once per pass over it, so as if nothing were kept from pass to pass;
//! nodal values stay in the caches and are left out, but where they are all that is moved. Rows of
//! the system are counted once in and once out. Operations: floating-point ones of the formulas, a
//! logarithm or an exponential as 20, a root or a division as one; work on indices is none.
#![allow(dead_code)]

use super::limits::Machine;

/// A 3 x 3 tensor, as points hold them.
const TENSOR: f64 = 72.0;

/// What the formulas read: a run's own numbers. All but the first three per point.
#[derive(Debug, Clone, Copy, Default)]
pub struct Numbers {
    pub dimension: usize,
    pub gimp: bool,
    pub plastic: bool,
    /// Nodes of a point.
    pub nodes: f64,
    /// Their number squared.
    pub pairs: f64,
    /// Groups of points with the same nodes; their nodes; the squares of those numbers.
    pub groups: f64,
    pub group_nodes: f64,
    pub group_pairs: f64,
    /// Stored places of the groups' blocks in the rows.
    pub places: f64,
    /// Populated cells, active nodes, blocks of D x D in their rows.
    pub cells: f64,
    pub active: f64,
    pub blocks: f64,
}

/// What a phase moves and computes for one point.
#[derive(Debug, Clone, Copy)]
pub struct Count {
    pub phase: &'static str,
    pub bytes: f64,
    pub operations: f64,
    /// It is compiled for the widest instruction set that is used, not for the baseline.
    pub wide: bool,
}

impl Count {
    /// Nanoseconds per point at the machine's bandwidth and at its peak arithmetic.
    pub fn limits(&self, machine: &Machine) -> [f64; 2] {
        let peak = if self.wide { machine.wide } else { machine.baseline };
        [self.bytes / machine.triad, self.operations / peak]
    }
}

/// Prints the head of the table that [`print`] fills.
pub fn print_head() {
    println!(
        "| case | phase | ns | bytes | operations | ns at the triad | ns at the peak | reached |\n\
         |---|---|---|---|---|---|---|---|"
    );
}

/// One row: `ns` per point beside the larger of the two limits.
pub fn print(case: &str, count: &Count, ns: f64, machine: &Machine) {
    let [bandwidth, arithmetic] = count.limits(machine);
    println!(
        "| {case} | {} | {ns:.0} | {:.0} | {:.0} | {bandwidth:.1} | {arithmetic:.1} | {:.0} % |",
        count.phase,
        count.bytes,
        count.operations,
        100.0 * bandwidth.max(arithmetic) / ns
    );
}

impl Numbers {
    fn axis(&self) -> f64 {
        self.dimension as f64
    }

    /// Bytes of a vector.
    fn vector(&self) -> f64 {
        8.0 * self.axis()
    }

    /// Bytes of a D x D tensor.
    fn plane(&self) -> f64 {
        8.0 * self.axis() * self.axis()
    }

    /// Position, and the half lengths that `gimp` reads with it.
    fn place(&self) -> f64 {
        self.vector() * if self.gimp { 2.0 } else { 1.0 }
    }

    /// Nodes, weights, gradients of a point.
    pub fn basis(&self) -> Count {
        let d = self.axis();
        let along = self.nodes.powf(1.0 / d);
        let line = if self.gimp { 8.0 + 14.0 * (along - 1.0) } else { 4.0 };
        Count {
            phase: "basis",
            bytes: self.place() + self.nodes * (16.0 + self.vector()) + 8.0,
            operations: d * line + self.nodes * d * d,
            wide: false,
        }
    }

    /// Basis, groups, populated cells, numbering, sparsity, places.
    pub fn system(&self) -> Count {
        let basis = self.basis();
        let list = 4.0 * self.group_nodes;
        let bytes = [
            basis.bytes,
            // groups: rows read; nodes, points and their offsets written
            8.0 * self.nodes + 8.0 * self.group_nodes + 24.0 * self.groups + 24.0,
            // cells of each point found, kept, united; their nodes
            self.place() + 4.0 + 32.0 * self.cells + 8.0 * self.active * 2f64.powf(self.axis()),
            // supports in small indices, for nodes and for groups; transposed: counted, filled
            8.0 * self.group_nodes + list + 8.0 * self.group_nodes + list + 3.0 * list,
            // rows: united, renumbered
            2.0 * list + 4.0 * self.blocks + 8.0 * self.blocks,
            // places: supports, holders, rows read, places written
            2.0 * list + 4.0 * self.blocks + 2.0 * self.places,
            // grip of the nodes: weights and gradients
            self.nodes * (8.0 + self.vector()) + list + 16.0,
        ];
        Count {
            phase: "system",
            bytes: bytes.iter().sum(),
            operations: basis.operations + self.nodes * (2.0 * self.axis() + 3.0),
            wide: false,
        }
    }

    /// Principal axes, logarithms and stress of the trial strain, without the new tensors.
    fn response(&self) -> f64 {
        let d = self.axis();
        let trial = d * d * (2.0 * d - 1.0) + 0.5 * d * (d + 1.0) * (2.0 * d - 1.0);
        let spectrum = if self.dimension == 2 { 20.0 } else { 150.0 };
        trial + spectrum + 63.0 + 25.0 + if self.plastic { 45.0 } else { 0.0 }
    }

    /// A tensor put together from principal values and axes.
    fn composed(&self) -> f64 {
        if self.dimension == 2 { 16.0 } else { 54.0 }
    }

    pub fn contribution(&self) -> Count {
        let d = self.axis();
        let placement = if self.dimension == 2 { 14.0 } else { 68.0 };
        let operations = [
            self.response() + self.composed() + placement,
            // axes in the frame; stress there; rates of the axes; the tensor of rank four
            d * d * (2.0 * d - 1.0),
            2.0 * d * d + 2.0 * d * d * d,
            10.0 * d * (d - 1.0) + (3.0 * d * d - 2.0 * d) * 3.0 * d * d,
            4.0 * d.powi(5),
        ];
        Count {
            phase: "stress + tangent",
            bytes: 2.0 * TENSOR + 8.0 + 4.0 + self.plane(),
            operations: operations.iter().sum(),
            wide: false,
        }
    }

    /// Stress, tangent, force and matrix of one evaluation.
    pub fn evaluation(&self) -> Count {
        let d = self.axis();
        let bytes = [
            2.0 * TENSOR + 8.0 + 4.0,
            // gradients; nodes, places, offsets; displacement and force
            self.nodes * self.vector() + 16.0,
            4.0 * self.group_nodes + 2.0 * self.places + 8.0 + 25.0 * self.groups,
            3.0 * self.vector() * self.active,
            // rows of the system
            2.0 * 8.0 * d * d * self.blocks,
        ];
        let operations = [
            self.contribution().operations,
            // increment, gradients in the frame, force
            self.nodes * 6.0 * d * d + d * d,
            // A : g for each node; products of the nodes; their sums into the rows
            d.powi(4) + self.nodes * d * d * d * (2.0 * d - 1.0),
            self.pairs * 2.0 * d * d * d,
            self.group_pairs * d * d,
        ];
        Count {
            phase: "evaluation",
            bytes: bytes.iter().sum(),
            operations: operations.iter().sum(),
            wide: true,
        }
    }

    /// y = K x: values, columns once for the D rows of a node, vectors.
    pub fn product(&self) -> Count {
        let d = self.axis();
        Count {
            phase: "product K x",
            bytes: self.blocks * (8.0 * d * d + 4.0 * d)
                + self.active * (2.0 * self.vector() + 4.0 * d),
            operations: 2.0 * d * d * self.blocks,
            wide: false,
        }
    }

    /// Increments, F, domain, stress, position.
    pub fn update(&self) -> Count {
        let d = self.axis();
        let corners = 2f64.powf(d);
        let bytes = [
            // row and its nodes; dF and displacement
            self.nodes * (8.0 + self.vector()) + 16.0 + 4.0 * self.group_nodes + 8.0,
            self.plane() + self.vector(),
            // F; stress, b_e and history; domain; position
            self.plane() + 2.0 * TENSOR,
            self.plane() + 3.0 * TENSOR + 44.0,
            if self.gimp { 3.0 * self.vector() } else { 0.0 },
            3.0 * self.vector(),
        ];
        let domain =
            if self.gimp { 8.0 * d + corners * (corners * 3.0 * d + 4.0 * d * d) } else { 0.0 };
        let operations = [
            self.nodes * (2.0 * d * d + 2.0 * d),
            3.0 * d * (2.0 * d - 1.0),
            self.response() + 2.0 * self.composed() + if self.plastic { 60.0 } else { 0.0 },
            domain + d + 8.0,
        ];
        Count {
            phase: "update",
            bytes: bytes.iter().sum(),
            operations: operations.iter().sum(),
            wide: false,
        }
    }

    /// The phases of an explicit step with lumped mass, `usl` and `flip`, `domain_update =
    /// "stretch"` with `gimp`: locate, assemble, update, migrate (a step that sorts nothing), and
    /// what is done between them.
    pub fn explicit(&self) -> [Count; 5] {
        let d = self.axis();
        let basis = self.basis();
        let row = self.nodes * (8.0 + self.vector()) + 16.0;
        let locate = [
            basis.bytes,
            8.0 * self.nodes + 8.0 * self.group_nodes + 24.0 * self.groups + 24.0,
            self.place() + 4.0 + 32.0 * self.cells + 8.0 * self.active * 2f64.powf(d),
        ];
        let assemble = [
            // mass; momentum and force
            8.0 * self.nodes + 24.0,
            row + TENSOR + self.vector() + 16.0,
        ];
        let update = [
            // rates and velocities; increments; their check
            8.0 * self.nodes + 16.0 + 3.0 * self.vector(),
            row + self.plane() + self.vector(),
            2.0 * self.vector() + self.plane(),
            // F; domain; stress; position
            2.0 * TENSOR + self.plane(),
            if self.gimp { TENSOR + 8.0 + 2.0 * self.vector() } else { 0.0 },
            self.plane() + 3.0 * TENSOR + 44.0,
            3.0 * self.vector(),
            // half lengths kept in case the step fails
            2.0 * self.vector(),
        ];
        let stress = [
            6.0 * d * d,
            self.response() + 2.0 * self.composed() + if self.plastic { 60.0 } else { 0.0 },
        ];
        let count = |phase, bytes: &[f64], operations| Count {
            phase,
            bytes: bytes.iter().sum(),
            operations,
            wide: false,
        };
        [
            count("locate", &locate, basis.operations),
            count("assemble", &assemble, d + d * d + self.nodes * (2.0 * d + 2.0 * d * d)),
            count(
                "update",
                &update,
                self.nodes * (4.0 * d + 2.0 * d * d) + 2.0 * d + stress.iter().sum::<f64>() + 30.0,
            ),
            // cells found and kept; their order, with the points' identities
            count("migrate", &[self.vector() + 8.0, 16.0], 2.0 * d),
            // sums of energy, momentum and its moment
            count(
                "other",
                &[8.0 + 2.0 * self.vector()],
                5.0 * d + if self.dimension == 2 { 4.0 } else { 12.0 },
            ),
        ]
    }
}
