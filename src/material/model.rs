//! `trait Model`: what a constitutive law owes, in principal axes of the logarithmic strain.

use super::parameter::Parameter;

/// The most state variables that a model may have.
pub const MOST_STATE: usize = 4;

/// A number that a point remembers from step to step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StateVariable {
    /// Name of the output field.
    pub name: &'static str,
    /// SI unit, "-" without.
    pub unit: &'static str,
    /// Value of an unstrained point.
    pub initial: f64,
}

/// What a model returns for one point, all in the principal axes of the trial strain.
#[derive(Debug, Clone, Copy)]
pub struct Response {
    /// Principal Kirchhoff stresses, Pa.
    pub stress: [f64; 3],
    /// Principal elastic logarithmic strains after the return.
    pub elastic_strain: [f64; 3],
    /// d stress_a / d trial_strain_b, Pa; need not be symmetric.
    pub tangent: [[f64; 3]; 3],
    /// (stress_a - stress_b) / (trial_strain_a - trial_strain_b) for the pairs 01, 12, 20, Pa,
    /// in the form that stays exact where the strains coincide.
    pub shear: [f64; 3],
    /// The model's state variables after the step; the others are zero.
    pub state: [f64; MOST_STATE],
    /// Norm of the plastic logarithmic strain increment; exactly zero where the step is elastic.
    pub plastic_increment: f64,
    /// Plastic work of the increment per unit of initial volume, J/m3.
    pub dissipation: f64,
}

impl Response {
    /// Without plastic flow: the tangent has `off` beside its diagonal, and there `two_mu` more.
    #[inline(always)]
    pub(super) fn elastic(
        trial: [f64; 3],
        stress: [f64; 3],
        [off, two_mu]: [f64; 2],
        state: [f64; MOST_STATE],
    ) -> Self {
        let mut tangent = [[off; 3]; 3];
        for (a, row) in tangent.iter_mut().enumerate() {
            row[a] += two_mu;
        }
        Response {
            stress,
            elastic_strain: trial,
            tangent,
            shear: [two_mu; 3],
            state,
            plastic_increment: 0.0,
            dissipation: 0.0,
        }
    }

    /// After a return to this stress.
    #[inline(always)]
    pub(super) fn returned(
        trial: [f64; 3],
        (stress, elastic_strain): ([f64; 3], [f64; 3]),
        (tangent, shear): ([[f64; 3]; 3], [f64; 3]),
        state: [f64; MOST_STATE],
    ) -> Self {
        let flow = [0, 1, 2].map(|a| trial[a] - elastic_strain[a]);
        let (plastic_increment, dissipation) = (dot(flow, flow).sqrt(), dot(stress, flow));
        Response { stress, elastic_strain, tangent, shear, state, plastic_increment, dissipation }
    }
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Why parameters do not fit each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Misfit {
    /// [`Parameter::key`] to be changed.
    pub key: &'static str,
    /// What is wrong and what would be right.
    pub why: String,
}

/// A constitutive law between the principal logarithmic strain and the Kirchhoff stress.
///
/// A value of the type holds what follows from its parameters, so that [`Model::respond`] computes
/// nothing twice.
pub trait Model: Copy + Sized {
    /// Deck value of `model`.
    const NAME: &'static str;
    /// One line for the deck reference.
    const DOC: &'static str;
    /// What it reads from the deck.
    const PARAMETERS: &'static [Parameter];
    /// Groups of keys. The deck gives exactly one key of each group; the text beside it is the error where it gives
    /// none.
    const ALTERNATIVES: &'static [(&'static [&'static str], &'static str)] = &[];
    /// Every state variable that it may have, with the initial value of its simplest form.
    const STATE: &'static [StateVariable] = &[];

    /// The model of the parameters in the order of [`Model::PARAMETERS`]. They lie in their
    /// ranges, and [`Model::check`] has passed them.
    fn new(parameters: &[f64]) -> Self;

    /// Whether parameters that lie in their ranges fit each other.
    fn check(parameters: &[f64]) -> Result<(), Misfit> {
        let _ = parameters;
        Ok(())
    }

    /// The state variables that a model of these parameters carries: a first part of
    /// [`Model::STATE`].
    fn state_words(&self) -> usize {
        Self::STATE.len()
    }

    /// The state of a point before anything has happened, under the stress that its principal
    /// elastic strains give. Not finite where that stress allows none.
    fn initial_state(&self, elastic_strain: [f64; 3]) -> [f64; MOST_STATE] {
        let _ = elastic_strain;
        let mut state = [0.0; MOST_STATE];
        for (word, variable) in state.iter_mut().zip(Self::STATE) {
            *word = variable.initial;
        }
        state
    }

    /// Stress, strain, tangent and state for principal trial strains. `state` holds at least
    /// [`Model::state_words`] numbers.
    fn respond(&self, trial: [f64; 3], state: &[f64]) -> Response;

    /// Principal elastic strains of principal Kirchhoff stresses (Pa), for initial stresses. Not
    /// finite where no elastic strain gives them.
    fn elastic_strain(&self, stress: [f64; 3]) -> [f64; 3];

    /// Stored energy of principal elastic strains per unit of initial volume, J/m3.
    fn energy(&self, elastic_strain: [f64; 3]) -> f64;

    /// lambda + 2 mu, Pa: with the density it gives the speed of pressure waves. `elastic_strain`
    /// computes the principal elastic strains, for models whose modulus depends on them.
    fn wave_modulus(&self, elastic_strain: impl FnOnce() -> [f64; 3]) -> f64;

    /// A modulus of the size of Young's, Pa: what Ghost stiffness and penalties are factors of.
    fn stiffness(&self) -> f64;

    /// A stress at yield, Pa, if it yields at any pressure: what a plan compares weights with.
    fn strength(&self) -> Option<f64> {
        None
    }

    /// Whether the tangent is symmetric in every state.
    fn symmetric(&self) -> bool;
}

/// What a model answers that is elastic below yield by another one, its `field`.
macro_rules! elastic_by {
    ($field:ident) => {
        fn elastic_strain(&self, stress: [f64; 3]) -> [f64; 3] {
            self.$field.elastic_strain(stress)
        }

        #[inline(always)]
        fn energy(&self, elastic_strain: [f64; 3]) -> f64 {
            self.$field.energy(elastic_strain)
        }

        fn wave_modulus(&self, elastic_strain: impl FnOnce() -> [f64; 3]) -> f64 {
            self.$field.wave_modulus(elastic_strain)
        }

        fn stiffness(&self) -> f64 {
            self.$field.stiffness()
        }
    };
}
pub(super) use elastic_by;

/// What a cone or pyramid answers whose strength stays, or changes with its first state variable.
macro_rules! perfect_or_changing {
    () => {
        const STATE: &'static [StateVariable] = &[softening::KAPPA];

        fn state_words(&self) -> usize {
            usize::from(self.change.is_some())
        }

        #[inline]
        fn respond(&self, trial: [f64; 3], state: &[f64]) -> Response {
            match &self.change {
                None => self.respond_perfectly(trial),
                Some(change) => self.respond_changing(change, trial, state[0]),
            }
        }
    };
}
pub(super) use perfect_or_changing;
