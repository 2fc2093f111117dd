//! What every field of a point is for alike: packing for migration and checkpoints, reordering, removal, undoing a step.

use nalgebra::Matrix3;

/// Declares the struct of arrays and everything that must treat each field alike: packing for
/// migration and checkpoints, reordering, removal, undoing a step. A field is an array of `f64` words per point.
macro_rules! point_fields {
    ($( $(#[$doc:meta])* $name:ident : $type:ty, $words:expr );* $(;)?) => {
        /// One rank's material points. `D` is the dimension of space; stress and deformation
        /// are always three-dimensional (plane strain for `D = 2`).
        #[derive(Debug, Clone, Default)]
        pub struct Points<const D: usize> {
            /// Stable identity over the whole run and over any number of ranks.
            pub id: Vec<u64>,
            /// Index into the deck's bodies.
            pub body: Vec<u32>,
            $( $(#[$doc])* pub $name: Vec<$type>, )*
            /// `corners` stays empty: a basis that reads none.
            pub cornerless: bool,
            /// State variables of the body's material.
            pub state: Named,
            /// Parameters of the body's material where they vary in space.
            pub parameters: Named,
            /// Elastic slip of contacts with friction, m: corner by corner in the frame of the rigid
            /// body, element by element of a surface that faces another body as F^-1 times the slip.
            pub slip: Named,
            /// `velocity_gradient` and `spread` are carried: an affine transfer.
            pub affine: bool,
            /// `displacement_start` is carried: a stage resets the displacement.
            pub counts_anew: bool,
            /// Their identities go from 0 on without gaps, over all bodies of the deck.
            pub counted: bool,
            /// What stands in the pores of all points.
            pub water: Option<Water>,
        }

        impl<const D: usize> Points<D> {
            /// Name and words per point of every floating-point field, in packing order.
            pub fn field_words() -> Vec<(&'static str, usize)> {
                vec![$( (stringify!($name), $words) ),*]
            }

            /// Words of one packed point without what its material asks for: id, body, the fields.
            pub fn base_words() -> usize { 2 $( + $words )* }

            /// Words of one packed point: [`Self::base_words`], then state, parameters and slip.
            pub fn record_words(&self) -> usize {
                Self::base_words()
                    + self.state.stride()
                    + self.parameters.stride()
                    + self.slip.stride()
            }

            /// Appends point `p` to `out` as words; integers travel as their bits.
            pub fn pack(&self, p: usize, out: &mut Vec<f64>) {
                out.push(f64::from_bits(self.id[p]));
                out.push(f64::from_bits(u64::from(self.body[p])));
                $( match self.$name.get(p) {
                    Some(value) => value.write_words(out),
                    None => out.resize(out.len() + $words, 0.0),
                } )*
                out.extend_from_slice(self.state.whole(p));
                out.extend_from_slice(self.parameters.whole(p));
                out.extend_from_slice(self.slip.whole(p));
            }

            /// Appends the point held in `words` (length [`Self::record_words`]).
            pub fn unpack(&mut self, words: &[f64]) {
                self.id.push(words[0].to_bits());
                self.body.push(words[1].to_bits() as u32);
                let mut rest = &words[2..];
                $( let value = <$type as Packed>::read_words(&mut rest);
                if self.carries(stringify!($name)) {
                    self.$name.push(value);
                } )*
                self.state.take(&mut rest);
                self.parameters.take(&mut rest);
                self.slip.take(&mut rest);
            }

            /// Body of a packed point.
            pub fn body_of(words: &[f64]) -> usize {
                words[1].to_bits() as usize
            }

            /// Drops all points but the first `count`.
            pub fn truncate(&mut self, count: usize) {
                self.id.truncate(count);
                self.body.truncate(count);
                $( self.$name.truncate(count); )*
                self.state.truncate(count);
                self.parameters.truncate(count);
                self.slip.truncate(count);
            }

            /// Keeps the points `order[0], order[1], ...` in that order and drops the others.
            pub fn select(&mut self, order: &[usize]) {
                let mut gather = Gather::new(order);
                gather.apply(&mut self.id);
                gather.apply(&mut self.body);
                $( gather.apply(&mut self.$name); )*
                self.state.gather(&mut gather);
                self.parameters.gather(&mut gather);
                self.slip.gather(&mut gather);
            }

            /// Moves points to other places, and drops those beyond the last.
            fn rearrange(&mut self, moves: &Moves) {
                moves.apply(&mut self.id);
                moves.apply(&mut self.body);
                $( moves.apply(&mut self.$name); )*
                self.state.rearrange(moves);
                self.parameters.rearrange(moves);
                self.slip.rearrange(moves);
            }

            /// Makes room for this many more points: by little where there is none, as an array
            /// that doubles is copied and leaves a hole in the heap.
            pub fn reserve(&mut self, more: usize) {
                if self.id.capacity() - self.len() >= more {
                    return;
                }
                let more = gather::with_slack(self.len() + more) - self.len();
                self.id.reserve_exact(more);
                self.body.reserve_exact(more);
                $( if self.carries(stringify!($name)) {
                    self.$name.reserve_exact(more);
                } )*
                self.state.reserve(more);
                self.parameters.reserve(more);
                self.slip.reserve(more);
            }

            /// Appends field `name` of point `p` to `out`; false if there is no such field.
            pub fn field_of(&self, name: &str, p: usize, out: &mut Vec<f64>) -> bool {
                match name {
                    $( stringify!($name) => {
                        match self.$name.get(p) {
                            Some(value) => value.write_words(out),
                            None => out.resize(out.len() + $words, 0.0),
                        }
                        true
                    } )*
                    _ => false,
                }
            }
        }

        /// The arrays of [`Points`] that a step has overwritten so far.
        #[derive(Default)]
        pub struct Snapshot<const D: usize> {
            $( /// The field as it was.
            pub $name: Former<$type>, )*
            /// State variables, row by row.
            pub state: Former<f64>,
            /// Elastic slip, row by row.
            pub slip: Former<f64>,
        }

        impl<const D: usize> Snapshot<D> {
            /// A new step begins: what the arrays hold is no longer wanted.
            pub fn begin(&mut self) {
                $( self.$name.forget(); )*
                self.state.forget();
                self.slip.forget();
            }

            /// The points as they were when the step began; they have not been reordered since.
            pub fn restore(&mut self, points: &mut Points<D>) {
                $( self.$name.give_back(&mut points.$name); )*
                self.state.give_back(&mut points.state.values);
                self.slip.give_back(&mut points.slip.values);
            }
        }
    };
}
pub(super) use point_fields;

/// A field's value as `f64` words.
pub trait Packed: Sized {
    /// Appends the value.
    fn write_words(&self, out: &mut Vec<f64>);
    /// Takes a value off the front.
    fn read_words(words: &mut &[f64]) -> Self;
}

impl Packed for f64 {
    fn write_words(&self, out: &mut Vec<f64>) {
        out.push(*self);
    }
    fn read_words(words: &mut &[f64]) -> Self {
        let value = words[0];
        *words = &words[1..];
        value
    }
}

impl<const D: usize> Packed for [f64; D] {
    fn write_words(&self, out: &mut Vec<f64>) {
        out.extend_from_slice(self);
    }
    fn read_words(words: &mut &[f64]) -> Self {
        std::array::from_fn(|_| f64::read_words(words))
    }
}

impl<const D: usize, const N: usize> Packed for [[f64; D]; N] {
    fn write_words(&self, out: &mut Vec<f64>) {
        for row in self {
            out.extend_from_slice(row);
        }
    }
    fn read_words(words: &mut &[f64]) -> Self {
        std::array::from_fn(|_| <[f64; D]>::read_words(words))
    }
}

impl Packed for Matrix3<f64> {
    fn write_words(&self, out: &mut Vec<f64>) {
        out.extend_from_slice(self.as_slice());
    }
    fn read_words(words: &mut &[f64]) -> Self {
        let value = Matrix3::from_column_slice(&words[..9]);
        *words = &words[9..];
        value
    }
}
