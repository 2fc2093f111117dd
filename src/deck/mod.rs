//! `input.toml`: text to a checked [`Deck`].
pub mod expression;
pub mod model;
pub mod shape;

pub use expression::{Expression, Scope};
pub use model::Deck;
pub use shape::Shape;
