//! `[analysis]` and `[element_test]`.

use crate::deck::choices::choices;

impl AnalysisType {
    /// Whether forces are in balance at the end of every step.
    pub fn is_static(self) -> bool {
        matches!(self, AnalysisType::QuasiStatic | AnalysisType::StrengthReduction)
    }

    /// Whether there is a time `t`, or only the load factor `s`.
    pub fn has_time(self) -> bool {
        matches!(self, AnalysisType::Explicit | AnalysisType::ImplicitDynamic)
    }
}

/// What is done to the one point of an element test.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementTest {
    /// Index into `Deck::materials`.
    pub material: usize,
    pub path: ElementPath,
    /// Pa, compression positive: isotropic stress at the start.
    pub confining: f64,
    /// Axial logarithmic strain at the end, compression positive, or the amount of shear.
    pub strain: f64,
    /// Of each leg of a history; of the whole test otherwise.
    pub steps: usize,
    /// Ends of the legs of `ElementPath::Strain`: principal logarithmic strains, tension positive.
    pub history: Vec<[f64; 3]>,
}

impl ElementTest {
    /// Steps of the whole test.
    pub fn total_steps(&self) -> usize {
        self.steps * self.history.len().max(1)
    }

    /// Strains after a step of the history.
    pub fn history_at(&self, step: usize) -> [f64; 3] {
        let leg = (step.max(1) - 1) / self.steps;
        let from = if leg == 0 { [0.0; 3] } else { self.history[leg - 1] };
        let share = (step - leg * self.steps) as f64 / self.steps as f64;
        [0, 1, 2].map(|a| from[a] + share * (self.history[leg][a] - from[a]))
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Analysis {
    pub kind: AnalysisType,
    pub symmetry: Symmetry,
    /// Equal load steps or time steps; `None` only with `cfl`.
    pub steps: Option<usize>,
    /// s; dynamics only.
    pub duration: Option<f64>,
    /// Fraction of the stability limit; explicit only, instead of `steps`.
    pub cfl: Option<f64>,
    /// Normalised residual (Lagrangian eq. 40), default 1e-9.
    pub tolerance: f64,
    /// Evaluations of the residual allowed in one step, the first at zero displacement included.
    pub max_iterations: usize,
    pub on_failure: OnFailure,
    /// With `on_failure = "cut"`: the smallest step, as a fraction of the nominal one (default 1/1024).
    pub smallest_step: f64,
    pub inverted_iterates: InvertedIterates,
    pub tangent: Tangent,
    /// Implicit dynamics: Newmark beta, gamma; or HHT alpha in [-1/3, 0] which sets both.
    pub newmark_beta: f64,
    pub newmark_gamma: f64,
    pub hht_alpha: f64,
    /// Strength reduction: width of the bracket around the factor, relative.
    pub strength_tolerance: f64,
    /// Of dynamics.
    pub damping: Option<Damping>,
}

/// What slows the nodes of a dynamic run down beside the materials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Damping {
    /// Share of the out-of-balance force that acts against the velocity, component by component.
    pub local: f64,
    /// Force against the velocity per momentum, 1/s.
    pub mass: f64,
}

choices! {
    AnalysisType {
        QuasiStatic = "quasi-static",
        Explicit = "explicit",
        ImplicitDynamic = "implicit-dynamic",
        Conditioning = "conditioning",
        /// Quasi-static, then with less and less strength.
        StrengthReduction = "strength-reduction",
        ElementTest = "element-test",
    }

    ElementPath {
        TriaxialDrained = "triaxial-drained",
        TriaxialUndrained = "triaxial-undrained",
        Oedometer = "oedometer",
        Isotropic = "isotropic",
        SimpleShear = "simple-shear",
        Biaxial = "biaxial",
        Strain = "strain",
    }

    /// What a problem in two dimensions stands for.
    #[derive(Default)]
    Symmetry {
        /// A slice of unit thickness that cannot stretch along z.
        #[default]
        PlaneStrain = "plane-strain",
        /// Half of a section through a body of revolution: x is the radius, y the axis. Volumes, masses,
        /// forces and energies are those of the whole turn.
        Axisymmetric = "axisymmetric",
    }

    OnFailure {
        Stop = "stop",
        Cut = "cut",
    }

    /// How the tangent of implicit steps is kept and solved with.
    Tangent {
        /// As symmetric where all materials and loads have a symmetric one.
        Auto = "auto",
        /// As unsymmetric, whatever they say.
        Unsymmetric = "unsymmetric",
    }

    InvertedIterates {
        Reject = "reject",
        Allow = "allow",
    }
}
