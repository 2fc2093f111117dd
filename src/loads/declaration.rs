//! What the deck asks of a load: its key in `[[load]]`, how the value is read, and how the resolved deck writes it.

use super::{Load, Start};
use crate::deck::expression::Expression;
use crate::deck::model::{Body, BodySurface};
use crate::deck::schema::{Key, Section};
use crate::deck::{Got, Table};
use crate::error::Result;

/// The deck around a load.
#[derive(Clone, Copy)]
pub struct Around<'a> {
    /// The whole of it.
    pub root: &'a Table<'a>,
    /// 2 or 3.
    pub dimension: usize,
    /// Names of the bodies, as written.
    pub names: &'a [String],
    /// The bodies as read, if that succeeded.
    pub bodies: Option<&'a [Body]>,
}

/// A load as the deck has it.
pub trait Declaration: Sized {
    /// In `[[load]]`: name, type, unit, meaning.
    const KEY: Key;

    /// The key's table, if it is one, and the tables inside.
    const SECTIONS: &'static [Section] = &[];

    /// Reads the key's value; reports what is wrong with it.
    fn read(table: &Table<'_>, around: &Around<'_>) -> Got<Self>;

    /// The value as TOML, with every default.
    fn written(&self, bodies: &[Body]) -> String;

    /// All formulas, with their keys below `load.INDEX`; those of a vector one after another. Time steps, stages and
    /// continued runs ask whether they depend on s or t, and the first step does not begin while one has no value.
    fn formulas(&self) -> Vec<(&'static str, &Expression)>;

    /// The body that it acts on alone.
    fn body(&self) -> Option<usize> {
        None
    }

    /// The body's own surface that it acts on, and its key below `load.INDEX`.
    fn surface(&self) -> Option<(&BodySurface, &'static str)> {
        None
    }

    /// Whether it may resist a motion along an axis, as a pressure does that varies along it.
    fn may_hold(&self, _axis: usize) -> bool {
        false
    }

    /// The load itself. Error: a formula cannot serve. Collective.
    fn make<const D: usize>(&self, start: Start<'_, D>) -> Result<Box<dyn Load<D>>>;
}

/// Formulas for all axes, under a key of a load.
pub fn expressions(table: &Table<'_>, key: &str, dimension: usize) -> Got<Vec<Expression>> {
    table.expressions_if(key, dimension)?.ok_or_else(|| table.missing(key, ""))
}

/// Formulas of a vector under one key, for [`Declaration::formulas`].
pub fn all_of<'a>(
    key: &'static str,
    formulas: &'a [Expression],
) -> Vec<(&'static str, &'a Expression)> {
    formulas.iter().map(|formula| (key, formula)).collect()
}

/// Makes the enumeration of the loads that a deck may have.
macro_rules! loads {
    ($( $(#[$when:meta])? $load:ident ),* $(,)?) => {
        /// A load as the deck has it.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Declared {
            $( $(#[$when])? #[doc = concat!("See [`", stringify!($load), "`].")] $load($load), )*
            /// Given pore water, of `[water]`: it lifts what is below its level.
            Water(Water),
        }

        /// Keys of `[[load]]` that say what the load is, in the order of the documentation.
        pub(crate) const KEYS: &[Key] = &[$( $(#[$when])? <$load as Declaration>::KEY ),*];

        /// Their tables.
        pub(crate) const SECTIONS: &[&[Section]] = &[$( $(#[$when])? <$load as Declaration>::SECTIONS ),*];

        impl Declared {
            /// Reads one of `[[load]]`.
            pub(crate) fn read(table: &Table<'_>, around: &Around<'_>) -> Got<Self> {
                let key = table.one_of(&KEYS.iter().map(|key| key.name).collect::<Vec<_>>())?;
                $( $(#[$when])? if key == <$load as Declaration>::KEY.name {
                    return Ok(Declared::$load(<$load as Declaration>::read(table, around)?));
                } )*
                Err(table.missing(key, ""))
            }

            /// Key and value of one of `[[load]]`.
            pub(crate) fn written(&self, bodies: &[Body]) -> Option<(&'static str, String)> {
                match self {
                    $( $(#[$when])? Declared::$load(load) => {
                        Some((<$load as Declaration>::KEY.name, load.written(bodies)))
                    } )*
                    Declared::Water(_) => None,
                }
            }

            /// The key of `[[load]]` that declares it.
            pub(crate) fn key(&self) -> &'static str {
                match self {
                    $( $(#[$when])? Declared::$load(_) => <$load as Declaration>::KEY.name, )*
                    Declared::Water(_) => "water",
                }
            }

            /// See [`Declaration::formulas`].
            pub fn formulas(&self) -> Vec<(&'static str, &Expression)> {
                match self {
                    $( $(#[$when])? Declared::$load(load) => load.formulas(), )*
                    Declared::Water(_) => Vec::new(),
                }
            }

            /// See [`Declaration::body`].
            pub fn body(&self) -> Option<usize> {
                match self {
                    $( $(#[$when])? Declared::$load(load) => load.body(), )*
                    Declared::Water(_) => None,
                }
            }

            /// See [`Declaration::surface`].
            pub fn surface(&self) -> Option<(&BodySurface, &'static str)> {
                match self {
                    $( $(#[$when])? Declared::$load(load) => load.surface(), )*
                    Declared::Water(_) => None,
                }
            }

            /// See [`Declaration::may_hold`].
            pub fn may_hold(&self, axis: usize) -> bool {
                match self {
                    $( $(#[$when])? Declared::$load(load) => load.may_hold(axis), )*
                    Declared::Water(_) => false,
                }
            }

            /// See [`Declaration::make`].
            pub fn make<const D: usize>(&self, start: Start<'_, D>) -> Result<Box<dyn Load<D>>> {
                match self {
                    $( $(#[$when])? Declared::$load(load) => load.make(start), )*
                    Declared::Water(water) => Ok(Box::new(*water)),
                }
            }
        }
    };
}
pub(super) use loads;
