//! What a term says of itself that a table of the deck switches on: its key and rows of the schema, how it is read and
//! written, and how it is made for a step. The program asks all such terms through [`Declared`](super::Declared).

use crate::deck::model::Body;
use crate::deck::schema::{Key, Section};
use crate::deck::{Got, Table};
use crate::error::Result;
use crate::loads::Around;
use crate::parallel::World;
use crate::points::Points;
use crate::system::conditions::StepSpan;
use crate::system::model::Model;
use crate::system::step_system::Discretisation;

use super::Term;
use super::term::{At, Part};
use crate::system::step_points::StepPoints;

/// The step that a term is made for.
#[derive(Clone, Copy)]
pub struct Context<'a, const D: usize> {
    /// The ranks.
    pub world: &'a World,
    /// What stays the same while points move.
    pub model: &'a Model<D>,
    /// Nodes, equations and sparsity.
    pub mesh: &'a Discretisation<D>,
    /// The points at the step's start, and their functions.
    pub step: StepPoints<'a, D>,
    /// Stage, load factors and times.
    pub span: StepSpan,
}

impl<'a, const D: usize> Context<'a, D> {
    /// `points`: those of `mesh`.
    pub fn new(
        world: &'a World,
        model: &'a Model<D>,
        (mesh, points): (&'a Discretisation<D>, &'a Points<D>),
        span: StepSpan,
    ) -> Self {
        Context { world, model, mesh, step: mesh.step_points(points, &model.materials), span }
    }
}

/// A table of the deck that adds a term to the equations.
pub trait Declaration: Sized {
    /// At the top level of the deck: a table, or an array of tables, each of which is a term. Its readers
    /// ([`Key::read_by`]) are the choices of the deck that know the term; with others the key is refused. A term
    /// without a force of its own at a step's start leaves out explicit analyses:
    /// [`IMPLICIT`](crate::deck::schema::IMPLICIT).
    const KEY: Key;

    /// Its table, and the tables inside.
    const SECTIONS: &'static [Section];

    /// Reads one table; reports what is wrong with it.
    fn read(table: &Table<'_>, around: &Around<'_>) -> Got<Self>;

    /// Keys and values as TOML, with every default; they read back to the same term.
    fn written(&self, bodies: &[Body]) -> Vec<(&'static str, String)>;

    /// The body that it acts on, if it is one alone.
    fn of_body(&self) -> Option<usize>;

    /// Whether it may resist a motion along an axis.
    fn may_hold(&self, axis: usize) -> bool;

    /// By how much it resists a motion of point `p` along each axis at the start of the run, N/m; zeros for a term
    /// that does not. It limits time steps of explicit analyses, and tells which pieces of the material are held.
    fn stiffness<const D: usize>(&self, points: &Points<D>, p: usize) -> [f64; D];

    /// The term of a step. In explicit analyses its force at the step's start acts: there it meets no rows, and
    /// the sparsity has fewer columns. Collective.
    fn make<'a, const D: usize>(&'a self, of: Context<'a, D>) -> Result<Box<dyn Term<D> + 'a>>;
}

/// The terms that the deck switches on, in one step. Collective.
pub fn of_deck<'a, const D: usize>(of: Context<'a, D>) -> Result<Vec<Box<dyn Term<D> + 'a>>> {
    of.model.deck.terms.iter().map(|term| term.make(of)).collect()
}

/// What these terms exert on the owned degrees of freedom where the nodal increments (local) are `displacement`, N;
/// nothing for none, zeros for `None`. Collective.
pub fn exerted<const D: usize>(
    of: Context<'_, D>,
    displacement: Option<&[f64]>,
) -> Result<Vec<f64>> {
    if of.model.deck.terms.is_empty() {
        return Ok(Vec::new());
    }
    let numbering = &of.mesh.numbering;
    let mut force = vec![0.0; numbering.len() * D];
    let still;
    let displacement = match displacement {
        Some(displacement) => displacement,
        None => {
            still = force.clone();
            &still
        }
    };
    let at = At { pattern: &of.mesh.pattern, displacement };
    let terms = of_deck(of)?;
    for part in [Part::Reaching, Part::Inner] {
        for term in &terms {
            term.add_shares(part, at, &mut force, None);
        }
    }
    numbering.halo.reverse_add(of.world, &mut force, D)?;
    force.truncate(numbering.owned * D);
    for term in &terms {
        term.add_force(at, &mut force);
    }
    // Terms add what resists the increments.
    force.iter_mut().for_each(|f| *f = -*f);
    Ok(force)
}

/// Makes the enumeration of the terms that a deck may switch on.
macro_rules! terms {
    ($( $(#[$when:meta])? $term:ident ),* $(,)?) => {
        /// A term as the deck has it.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Declared {
            $( $(#[$when])? #[doc = concat!("See [`", stringify!($term), "`].")] $term($term), )*
        }

        /// Keys of the top level that switch a term on, in the order of the documentation.
        pub(crate) const KEYS: &[Key] = &[$( $(#[$when])? <$term as Declaration>::KEY ),*];

        /// Their tables.
        pub(crate) const SECTIONS: &[&[Section]] = &[$( $(#[$when])? <$term as Declaration>::SECTIONS ),*];

        impl Declared {
            /// Reads all that a deck switches on.
            pub(crate) fn read(root: &Table<'_>, around: &Around<'_>) -> Got<Vec<Self>> {
                let mut all = Vec::new();
                $( $(#[$when])? {
                    let name = <$term as Declaration>::KEY.name;
                    let one = |table: Table<'_>| {
                        <$term as Declaration>::read(&table, around).map(Declared::$term)
                    };
                    match <$term as Declaration>::KEY.kind {
                        Kind::Tables(_) => all.extend(root.tables(name, |_, table| one(table))?),
                        _ => all.extend(root.table_if(name, one)?),
                    }
                } )*
                Ok(all)
            }

            /// See [`Declaration::KEY`].
            pub(crate) fn key(&self) -> &'static Key {
                match self { $( $(#[$when])? Declared::$term(_) => &<$term as Declaration>::KEY, )* }
            }

            /// See [`Declaration::written`].
            pub(crate) fn written(&self, bodies: &[Body]) -> Vec<(&'static str, String)> {
                match self { $( $(#[$when])? Declared::$term(term) => term.written(bodies), )* }
            }

            /// See [`Declaration::of_body`].
            pub(crate) fn of_body(&self) -> Option<usize> {
                match self { $( $(#[$when])? Declared::$term(term) => term.of_body(), )* }
            }

            /// See [`Declaration::may_hold`].
            pub(crate) fn may_hold(&self, axis: usize) -> bool {
                match self { $( $(#[$when])? Declared::$term(term) => term.may_hold(axis), )* }
            }

            /// See [`Declaration::stiffness`].
            pub(crate) fn stiffness<const D: usize>(&self, points: &Points<D>, p: usize) -> [f64; D] {
                match self { $( $(#[$when])? Declared::$term(term) => term.stiffness(points, p), )* }
            }

            /// See [`Declaration::make`].
            pub(crate) fn make<'a, const D: usize>(
                &'a self,
                of: Context<'a, D>,
            ) -> Result<Box<dyn Term<D> + 'a>> {
                match self { $( $(#[$when])? Declared::$term(term) => term.make(of), )* }
            }
        }
    };
}
pub(super) use terms;
