//! What a basis says of itself before there are points and a grid: its word in the deck, what its domains are, how
//! large its rows are.

use crate::deck::model::GimpEdge;

/// The part of space that a point stands for, as its functions see it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Domain {
    /// The point alone.
    None,
    /// A box along the axes of a lattice, by its half lengths.
    Box,
    /// A parallelogram or parallelepiped that deforms with F.
    Parallelepiped,
    /// A quadrilateral or hexahedron by corners that the points carry.
    Corners,
}

impl Domain {
    /// Whether corners that move with the material say where it lies.
    pub fn has_corners(self) -> bool {
        matches!(self, Domain::Parallelepiped | Domain::Corners)
    }
}

/// A value of `method.basis`.
pub trait Declaration: Sized {
    /// The deck's word.
    const WORD: &'static str;

    /// A line for `--list`.
    const DOC: &'static str;

    /// What its domains are.
    const DOMAIN: Domain;

    /// In the plane and in space: nodes of a point's row, and of a node's row of the matrix. For the estimate of memory.
    const NODES: [(usize, usize); 2];

    /// The functions of a deck; `edge`: what a domain that reaches over the grid's edge meets there.
    fn of_deck(edge: GimpEdge) -> Self;
}

/// Makes the enumeration of the bases that a deck may have.
macro_rules! bases {
    ($( $(#[$when:meta])? $basis:ident ),* $(,)?) => {
        /// A basis as the deck has it.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Declared {
            $( $(#[$when])? #[doc = concat!("See [`", stringify!($basis), "`].")] $basis, )*
        }

        impl Choice for Declared {
            const SPELLINGS: &'static [(&'static str, Self)] =
                &[$( $(#[$when])? (<$basis as Declaration>::WORD, Declared::$basis) ),*];
        }

        impl Declared {
            /// All words of the deck for this choice.
            pub const NAMES: &'static [&'static str] =
                &[$( $(#[$when])? <$basis as Declaration>::WORD ),*];

            /// The deck's word.
            pub fn name(self) -> &'static str {
                match self { $( $(#[$when])? Declared::$basis => <$basis as Declaration>::WORD, )* }
            }

            /// See [`Declaration::DOC`].
            pub fn doc(self) -> &'static str {
                match self { $( $(#[$when])? Declared::$basis => <$basis as Declaration>::DOC, )* }
            }

            /// See [`Declaration::DOMAIN`].
            pub fn domain(self) -> Domain {
                match self { $( $(#[$when])? Declared::$basis => <$basis as Declaration>::DOMAIN, )* }
            }

            /// See [`Declaration::NODES`].
            pub fn nodes(self, dimension: usize) -> (usize, usize) {
                let both = match self { $( $(#[$when])? Declared::$basis => <$basis as Declaration>::NODES, )* };
                both[usize::from(dimension == 3)]
            }
        }

        /// The functions of a deck.
        pub fn of_deck<const D: usize>(basis: Declared, edge: GimpEdge) -> Box<dyn contract::Basis<D>> {
            match basis {
                $( $(#[$when])? Declared::$basis => Box::new(<$basis as Declaration>::of_deck(edge)), )*
            }
        }
    };
}
pub(super) use bases;
