//! A formula as a list of operations on a stack, for any kind of number.

use super::operators::{BINARY, FUNCTIONS, holds, truth};
use super::{Scope, Variable};

/// What takes its arguments from the top of the stack and leaves its value there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Operation {
    Number(f64),
    Variable(Variable),
    Negate,
    Not,
    /// Place in [`FUNCTIONS`].
    Function(usize),
    /// Place in [`BINARY`].
    Binary(usize),
    /// Takes a value and goes on at this operation if it does not hold.
    Unless(usize),
    /// Goes on at this operation.
    Skip(usize),
}

/// Numbers that formulas are evaluated on.
pub trait Algebra {
    type Number: Copy;
    fn number(&self, value: f64) -> Self::Number;
    fn negated(&self, a: Self::Number) -> Self::Number;
    /// 1 for a value that does not hold, else 0.
    fn inverted(&self, a: Self::Number) -> Self::Number;
    /// Whether a condition of this value is met.
    fn holds(&self, a: Self::Number) -> bool;
    /// The function at that place of [`FUNCTIONS`].
    fn function(&self, place: usize, a: Self::Number) -> Self::Number;
    /// The operator at that place of [`BINARY`].
    fn binary(&self, place: usize, a: Self::Number, b: Self::Number) -> Self::Number;
}

/// Of plain numbers.
pub struct Plain;

impl Algebra for Plain {
    type Number = f64;
    fn number(&self, value: f64) -> f64 {
        value
    }

    fn negated(&self, a: f64) -> f64 {
        -a
    }

    fn inverted(&self, a: f64) -> f64 {
        truth(!holds(a))
    }

    fn holds(&self, a: f64) -> bool {
        holds(a)
    }

    #[inline]
    fn function(&self, place: usize, a: f64) -> f64 {
        FUNCTIONS[place].1(a)
    }

    #[inline]
    fn binary(&self, place: usize, a: f64, b: f64) -> f64 {
        BINARY[place].1(a, b)
    }
}

/// Values on the stack that need no memory of their own.
const SHALLOW: usize = 24;

/// A formula ready to be evaluated.
#[derive(Debug, Clone, Default)]
pub struct Program {
    operations: Vec<Operation>,
    /// Operations before this one lie behind a branch: they are not computed beforehand.
    sealed: usize,
    /// Values on the stack after the last operation, and the most there are at a time.
    depth: usize,
    deepest: usize,
}

impl Program {
    pub fn operations(&self) -> &[Operation] {
        &self.operations
    }

    pub fn contains(&self, variable: Variable) -> bool {
        self.operations.contains(&Operation::Variable(variable))
    }

    /// Appends an operation; on numbers alone it is computed at once.
    pub fn push(&mut self, operation: Operation) {
        use Operation::{Binary, Function, Negate, Not, Number, Skip, Unless, Variable};
        match operation {
            Number(_) | Variable(_) => {
                self.depth += 1;
                self.deepest = self.deepest.max(self.depth);
            }
            Binary(_) | Unless(_) | Skip(_) => self.depth -= 1,
            Negate | Not | Function(_) => {}
        }
        let open = &self.operations[self.sealed..];
        let known = match (open, operation) {
            ([.., Number(a)], Negate) => Some((1, -a)),
            ([.., Number(a)], Not) => Some((1, Plain.inverted(*a))),
            ([.., Number(a)], Function(place)) => Some((1, Plain.function(place, *a))),
            ([.., Number(a), Number(b)], Binary(place)) => Some((2, Plain.binary(place, *a, *b))),
            _ => None,
        };
        let operation = match known {
            Some((taken, value)) => {
                self.operations.truncate(self.operations.len() - taken);
                Number(value)
            }
            None => operation,
        };
        self.operations.push(operation);
    }

    /// Appends a jump whose end is not known yet; returns its place.
    pub fn branch(&mut self, operation: fn(usize) -> Operation) -> usize {
        self.push(operation(usize::MAX));
        self.sealed = self.operations.len();
        self.operations.len() - 1
    }

    /// Lets the jump at `place` end at the next operation.
    pub fn land(&mut self, place: usize) {
        let next = self.operations.len();
        self.operations[place] = match self.operations[place] {
            Operation::Unless(_) => Operation::Unless(next),
            _ => Operation::Skip(next),
        };
        self.sealed = next;
    }

    /// The value, with `of` giving those of the variables.
    pub fn value<A: Algebra>(&self, algebra: &A, of: impl Fn(Variable) -> A::Number) -> A::Number {
        if self.deepest <= SHALLOW {
            self.run(algebra, &mut [algebra.number(0.0); SHALLOW], of)
        } else {
            self.run(algebra, &mut vec![algebra.number(0.0); self.deepest], of)
        }
    }

    fn run<A: Algebra>(
        &self,
        algebra: &A,
        stack: &mut [A::Number],
        of: impl Fn(Variable) -> A::Number,
    ) -> A::Number {
        let (mut top, mut next) = (0, 0);
        while let Some(&operation) = self.operations.get(next) {
            next += 1;
            match operation {
                Operation::Number(value) => {
                    stack[top] = algebra.number(value);
                    top += 1;
                }
                Operation::Variable(variable) => {
                    stack[top] = of(variable);
                    top += 1;
                }
                Operation::Negate => stack[top - 1] = algebra.negated(stack[top - 1]),
                Operation::Not => stack[top - 1] = algebra.inverted(stack[top - 1]),
                Operation::Function(place) => {
                    stack[top - 1] = algebra.function(place, stack[top - 1])
                }
                Operation::Binary(place) => {
                    top -= 1;
                    stack[top - 1] = algebra.binary(place, stack[top - 1], stack[top]);
                }
                Operation::Unless(other) => {
                    top -= 1;
                    if !algebra.holds(stack[top]) {
                        next = other;
                    }
                }
                Operation::Skip(end) => next = end,
            }
        }
        stack[0]
    }

    /// The value on plain numbers.
    pub fn number(&self, scope: &Scope) -> f64 {
        self.value(&Plain, |variable| scope.value(variable))
    }
}
