//! `[[verify]]`, `[[probe]]`, `[output]` and `[parallel]`.

use crate::deck::choices::choices;
use crate::deck::expression::Expression;

#[derive(Debug, Clone, PartialEq)]
pub struct Verify {
    pub name: String,
    /// e.g. `stress.yy`, `displacement.x`, `displacement`, `velocity.x`, `J`.
    pub field: String,
    /// One expression, or one per component for a vector field.
    pub exact: Vec<Expression>,
    pub norm: VerifyNorm,
    pub scale: f64,
}

/// `[[probe]]`
#[derive(Debug, Clone, PartialEq)]
pub struct Probe {
    pub name: String,
    pub spot: Spot,
    /// Fields or components, as written: `displacement`, `stress.yy`.
    pub fields: Vec<String>,
}

/// What a probe follows.
#[derive(Debug, Clone, PartialEq)]
pub enum Spot {
    /// The point, of all or of one body, that is nearest to a place (m) at the start.
    Near {
        place: Vec<f64>,
        body: Option<usize>,
    },
    Id(u64),
    /// The mean over a body.
    Mean(usize),
}

#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    pub every: Every,
    /// Between rows of the history.
    pub history: Every,
    /// Between lines on the terminal and in the log; seconds of wall time. By default one a second
    /// in explicit analyses, whose steps are short, and one a step in others.
    pub log: Every,
    /// Point fields to write.
    pub fields: Vec<String>,
    pub checkpoint: Option<Checkpoint>,
    /// For whom the frames are prepared.
    pub formats: Vec<Format>,
    /// `report.html` at the end of the run.
    pub report: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Every {
    Steps(usize),
    /// s of simulated time
    Seconds(f64),
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Checkpoint {
    /// Steps between checkpoints, if any.
    pub every: Option<usize>,
    /// Minutes of wall time between checkpoints, if any.
    pub minutes: Option<f64>,
    /// How many to keep (default 2).
    pub keep: usize,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parallel {
    pub initial: Initial,
    /// What is levelled.
    pub cost: Cost,
    /// Cells per side of a lattice brick, the unit of partition; `None`: chosen by size.
    pub brick: Option<usize>,
    /// Repartition when max/mean cost exceeds this (default 1.1); 0 switches it off.
    pub rebalance_above: f64,
}

choices! {
    VerifyNorm {
        /// sum |a - b| V0 / (scale V0_total), Lagrangian eq. 42.
        VolumeL1 = "volume-l1",
        /// sqrt(sum |a - b|^2 V0 / V0_total) / scale
        VolumeL2 = "volume-l2",
        /// max |a - b| / scale
        Max = "max",
    }

    /// Readers of frames.
    Format {
        /// XDMF beside the HDF5 files.
        Xdmf = "xdmf",
        /// The HDF5 files of the points are VTKHDF files as well.
        VtkHdf = "vtkhdf",
        /// VTK files of the points, too.
        Vtu = "vtu",
    }

    /// How the first partition is made.
    Initial {
        Balanced = "balanced",
        /// Equal slices of the grid, for comparison.
        Slabs = "slabs",
    }

    /// What a point costs.
    Cost {
        /// One: partitions, and so results, repeat bit by bit.
        Points = "points",
        /// The seconds that its rank spends, smoothed: follows uneven machines and materials.
        Time = "time",
    }
}
