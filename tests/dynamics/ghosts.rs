//! The ghosts of the decks in their three resolutions.

use crate::common::run::Run;

/// Seeding of the ghost's points; the translations make the domains touch the corners of the
/// unit square.
pub struct Resolution {
    pub name: &'static str,
    spacing: &'static str,
    offset: &'static str,
    translate: [&'static str; 2],
}

pub const COARSE: Resolution = Resolution {
    name: "coarse",
    spacing: "0.012891725812599513",
    offset: "[0.2, 0.2077994941166227]",
    translate: [
        "[-0.0001782499047075477, 0.004913981791269259]",
        "[0.6001782499047075, 0.6052704816006843]",
    ],
};
pub const MEDIUM: Resolution = Resolution {
    name: "medium",
    spacing: "0.006703772139933158",
    offset: "[0.2016759430349833, 0.20013407544279868]",
    translate: [
        "[0.0027891072329780313, -0.0023727973147705046]",
        "[0.6005627788369885, 0.6021046464291733]",
    ],
};
pub const FINE: Resolution = Resolution {
    name: "fine",
    spacing: "0.00334193384036919",
    offset: "[0.2008354834600923, 0.20033419338403693]",
    translate: [
        "[0.0013515138822436973, -0.0014891298820701132]",
        "[0.6003194530379409, 0.6008207431139962]",
    ],
};

impl Resolution {
    /// Puts the first `bodies` bodies of a deck at this resolution.
    pub fn seed(&self, mut run: Run, bodies: usize) -> Run {
        for body in 0..bodies {
            run = run
                .set(format!("body.{body}.lattice.spacing={}", self.spacing))
                .set(format!("body.{body}.lattice.offset={}", self.offset))
                .set(format!("body.{body}.shape.translate={}", self.translate[body]));
        }
        run
    }
}

/// The collision of coarse ghosts, without output between start and end.
pub fn collision() -> Run {
    COARSE.seed(Run::of("ghost-collision"), 2).set("output.every=100000")
}

/// The same, so near that contact begins at once: `steps` steps of 3.5 ms.
pub fn contact(steps: usize) -> Run {
    collision()
        .set("body.1.shape.translate=[0.3, 0.36]")
        .set(format!("analysis.steps={steps}"))
        .set(format!("analysis.duration={:?}", 3.5e-3 * steps as f64))
}
