//! Material models in logarithmic strain, principal axes.
//!
//! The multiplicative split with the exponential map lets small-strain algorithms act on the
//! principal values of the trial elastic logarithmic strain (Lagrangian §2). A model turns them
//! into Kirchhoff stress, elastic strain and the consistent tangent; the axes do not change.
//! Yield functions act on the Kirchhoff stress: a cohesion c acts as c/J in the Cauchy stress.
//!
//! | deck value | type | file | source |
//! |---|---|---|---|
//! | `hencky` | [`Hencky`] | `hencky.rs` | Lagrangian §2 |
//! | `von-mises` | [`VonMises`] | `von_mises.rs` | Lagrangian eq. 43 |
//! | `neo-hookean` | [`NeoHookean`] | `neo_hookean.rs` | Bonet, Wood 2008, eq. 6.27 |
//! | `tresca` | [`Tresca`] | `tresca.rs` | Mohr-Coulomb without friction |
//! | `mohr-coulomb` | [`MohrCoulomb`] | `mohr_coulomb.rs` | Clausen et al. 2007 |
//! | `drucker-prager` | [`DruckerPrager`] | `drucker_prager.rs` | de Souza Neto et al. 2008, 8.3 |
//! | `cam-clay` | [`CamClay`] | `cam_clay.rs` | Borja, Tamagnini 1998 |
//!
//! | file | idea |
//! |---|---|
//! | `model.rs` | [`Model`]: what each of them owes |
//! | `local.rs` | [`LocalMaterial`]: the model with the parameters that hold at a point |
//! | `softening.rs` | strength that falls or grows with plastic strain |
//! | `parameter.rs` | [`Parameter`]: what it reads from the deck |
//! | `mod.rs` | the catalogue: a model is one file and one line here |
//!
//! Where parameters vary in space, each point carries its own, and the model is made from them
//! whenever the point responds; where they are numbers, it is made once for the body.

pub(crate) mod cam_clay;
pub(crate) mod drucker_prager;
pub(crate) mod hencky;
mod local;
mod model;
pub(crate) mod mohr_coulomb;
pub(crate) mod neo_hookean;
pub mod parameter;
#[cfg(test)]
mod published;
#[cfg(test)]
mod published_clay;
#[cfg(test)]
mod published_metals;
mod softening;
#[cfg(test)]
mod softening_tests;
pub(crate) mod tresca;
pub(crate) mod von_mises;

#[cfg(test)]
mod tests;

pub use cam_clay::CamClay;
pub use drucker_prager::DruckerPrager;
pub use hencky::Hencky;
pub use local::{LocalMaterial, local};
pub use model::{MOST_STATE, Misfit, Model, Response, StateVariable};
pub use mohr_coulomb::MohrCoulomb;
pub use neo_hookean::NeoHookean;
pub use parameter::Parameter;
pub use tresca::Tresca;
pub use von_mises::VonMises;

/// Makes the enumeration of the models, which dispatches once per point, and their catalogue.
macro_rules! models {
    ($( $model:ident ),* $(,)?) => {
        /// A body's model with its parameters.
        #[derive(Debug, Clone, Copy)]
        pub enum Material {
            $( #[doc = concat!("See [`", stringify!($model), "`].")] $model($model), )*
        }

        /// All models, in the order of the documentation.
        pub static CATALOGUE: &[Entry] = &[$( Entry {
            name: <$model as Model>::NAME,
            doc: <$model as Model>::DOC,
            parameters: <$model as Model>::PARAMETERS,
            alternatives: <$model as Model>::ALTERNATIVES,
            state: <$model as Model>::STATE,
            check: <$model as Model>::check,
            make: |parameters| Material::$model(<$model as Model>::new(parameters)),
        } ),*];

        impl Material {
            /// The model of `own` parameters in the place of this one's.
            fn with(&self, own: &[f64]) -> Material {
                match self {
                    $( Material::$model(_) => {
                        Material::$model(<$model as Model>::new(own))
                    } )*
                }
            }

            /// See [`Model::respond`].
            #[inline(always)]
            pub fn respond(&self, trial: [f64; 3], state: &[f64]) -> Response {
                match self { $( Material::$model(model) => model.respond(trial, state), )* }
            }

            /// See [`Model::energy`].
            #[inline(always)]
            pub fn energy(&self, elastic_strain: [f64; 3]) -> f64 {
                match self { $( Material::$model(model) => Model::energy(model, elastic_strain), )* }
            }

            /// [`Model::respond`] and [`Model::energy`] of the first `count` points: `take` gets
            /// what the trial strains and the state of each come to. One dispatch for all.
            #[inline(always)]
            pub(crate) fn respond_each<'a>(
                &self,
                count: usize,
                trial: impl Fn(usize) -> [f64; 3],
                state: impl Fn(usize) -> &'a [f64],
                mut take: impl FnMut(usize, Response, f64),
            ) {
                match self { $( Material::$model(model) => {
                    for k in 0..count {
                        let response = model.respond(trial(k), state(k));
                        let energy = Model::energy(model, response.elastic_strain);
                        take(k, response, energy);
                    }
                } )* }
            }

            /// See [`Model::elastic_strain`].
            pub fn elastic_strain(&self, stress: [f64; 3]) -> [f64; 3] {
                match self { $( Material::$model(model) => model.elastic_strain(stress), )* }
            }

            /// See [`Model::wave_modulus`].
            pub fn wave_modulus(&self, elastic_strain: impl FnOnce() -> [f64; 3]) -> f64 {
                match self { $( Material::$model(model) => model.wave_modulus(elastic_strain), )* }
            }

            /// See [`Model::stiffness`].
            pub fn stiffness(&self) -> f64 {
                match self { $( Material::$model(model) => model.stiffness(), )* }
            }

            /// See [`Model::strength`].
            pub fn strength(&self) -> Option<f64> {
                match self { $( Material::$model(model) => model.strength(), )* }
            }

            /// See [`Model::symmetric`].
            pub fn symmetric(&self) -> bool {
                match self { $( Material::$model(model) => model.symmetric(), )* }
            }

            /// The state variables that it carries.
            pub fn state(&self) -> &'static [StateVariable] {
                match self { $(
                    Material::$model(model) => &<$model as Model>::STATE[..model.state_words()],
                )* }
            }

            /// See [`Model::initial_state`].
            pub fn initial_state(&self, elastic_strain: [f64; 3]) -> [f64; MOST_STATE] {
                match self { $( Material::$model(model) => model.initial_state(elastic_strain), )* }
            }
        }
    };
}

models! { Hencky, NeoHookean, VonMises, Tresca, MohrCoulomb, DruckerPrager, CamClay }

/// What is known of a model before it has parameters.
#[derive(Clone, Copy)]
pub struct Entry {
    /// Deck value of `model`.
    pub name: &'static str,
    /// One sentence for lists and the reference.
    pub doc: &'static str,
    /// Keys that it reads.
    pub parameters: &'static [Parameter],
    /// See [`Model::ALTERNATIVES`].
    pub alternatives: &'static [(&'static [&'static str], &'static str)],
    /// See [`Model::STATE`].
    pub state: &'static [StateVariable],
    /// See [`Model::check`].
    pub check: fn(&[f64]) -> Result<(), Misfit>,
    /// The model of these parameters.
    pub make: fn(&[f64]) -> Material,
}

/// The parameters of a law of the catalogue, given by key or what holds without, and the law.
#[cfg(test)]
pub fn law(name: &str, given: &[(&str, f64)]) -> (Vec<f64>, Material) {
    let entry = entry(name).expect("a law of the catalogue");
    let value = |known: &Parameter| {
        let given = given.iter().find(|(key, _)| *key == known.key);
        given.map_or_else(|| known.value_if_absent(), |(_, value)| *value)
    };
    let values: Vec<f64> = entry.parameters.iter().map(value).collect();
    let made = (entry.make)(&values);
    (values, made)
}

#[cfg(test)]
impl Entry {
    /// The first parameters as `given`, the others as where the deck leaves them out.
    pub fn completed(&self, given: &[f64]) -> Vec<f64> {
        let rest = self.parameters[given.len()..].iter().map(Parameter::value_if_absent);
        given.iter().copied().chain(rest).collect()
    }
}

impl PartialEq for Entry {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl std::fmt::Debug for Entry {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

/// The model of that name.
pub fn entry(name: &str) -> Option<&'static Entry> {
    CATALOGUE.iter().find(|entry| entry.name == name)
}

/// All names of state variables, each once.
pub fn state_variables() -> Vec<StateVariable> {
    let mut all: Vec<StateVariable> = Vec::new();
    for variable in CATALOGUE.iter().flat_map(|entry| entry.state) {
        if !all.iter().any(|known| known.name == variable.name) {
            all.push(*variable);
        }
    }
    all
}
