//! Surfaces that are held where they were at the start, or as their stage began ([`super::holds`]), or driven, by a penalty (formulations.md
//! B.6 (a)): the force on an element of the area A is -β A P (x_s - X_s - ū), with P the unit tensor,
//! chosen components or n ⊗ n, and β = penalty E / h.

use crate::deck::Scope;
use crate::deck::expression::Expression;
use crate::deck::model::{Boundary, SupportMethod};
use crate::deck::stage::{Stage, begin_of};
use crate::loads::Moment;
use crate::surface::sheet::Sheet;
use crate::surface::{Element, Surface, norm};

/// What is held of an element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Hold<const D: usize> {
    Components([bool; D]),
    /// Along the normal at the start.
    Normal,
}

/// A support of the deck with its surface.
pub struct Support<const D: usize> {
    /// Index into the deck's boundaries.
    pub boundary: usize,
    pub surface: Surface<D>,
    hold: Hold<D>,
    /// β over the stiffness of the body, 1/m.
    pub penalty: f64,
    /// The material's own traction acts besides (Nitsche's method), so that the penalty bears what is
    /// left of it.
    pub nitsche: bool,
    displacement: Vec<(usize, Expression)>,
    /// What lies beyond it is free.
    pub within: Option<Sheet<D>>,
    /// The later stage that it comes with, and t as that begins, s.
    pub comes: Option<(usize, f64)>,
}

impl<const D: usize> Support<D> {
    /// `cell`: size of the grid's cells, m; `stages` of the deck. `None` for a boundary that holds nodes.
    pub fn new(
        (index, boundary): (usize, &Boundary),
        surface: Surface<D>,
        within: Option<Sheet<D>>,
        (cell, stages): (f64, &[Stage]),
    ) -> Option<Self> {
        let support = boundary.support()?;
        let from = boundary.presence.from.filter(|from| *from > 0);
        let comes = from.map(|from| (from, begin_of(stages, from)));
        let mut components = [boundary.fix.is_empty() && boundary.displacement.is_empty(); D];
        let driven = boundary.displacement.iter().map(|(axis, _)| *axis);
        boundary.fix.iter().copied().chain(driven).for_each(|axis| components[axis] = true);
        let hold = if support.slip { Hold::Normal } else { Hold::Components(components) };
        Some(Support {
            boundary: index,
            surface,
            hold,
            penalty: support.penalty / cell,
            nitsche: support.method == SupportMethod::Nitsche,
            displacement: boundary.displacement.clone(),
            within,
            comes,
        })
    }

    /// P
    pub fn projection(&self, element: &Element<D>) -> [[f64; D]; D] {
        match &self.hold {
            Hold::Components(held) => std::array::from_fn(|i| {
                std::array::from_fn(|j| if i == j && held[i] { 1.0 } else { 0.0 })
            }),
            Hold::Normal => {
                let size = norm(&element.area);
                let n = element.area.map(|a| a / size);
                std::array::from_fn(|i| std::array::from_fn(|j| n[i] * n[j]))
            }
        }
    }

    /// ū at an element, m: a value that holds neither s nor t is reached linearly with the load
    /// factor, one that does counts from the start, or from that of the stage it comes with.
    pub fn prescribed(&self, element: &Element<D>, at: Moment) -> [f64; D] {
        let mut u = [0.0; D];
        for (axis, expression) in &self.displacement {
            let mut initial = [0.0; 3];
            initial[..D].copy_from_slice(&element.place);
            let value = |load_factor: f64, time: f64| {
                expression.value(&Scope { initial, current: initial, load_factor, time })
            };
            let now = value(at.load_factor, at.time);
            u[*axis] = match expression.depends_on_time() {
                true => now - value(0.0, self.comes.map_or(0.0, |(_, since)| since)),
                false => now * at.load_factor,
            };
        }
        u
    }

    /// Where an element has to be, m, that was `held` there.
    pub fn target(&self, element: &Element<D>, held: &Element<D>, at: Moment) -> [f64; D] {
        let u = self.prescribed(element, at);
        std::array::from_fn(|i| held.place[i] + u[i])
    }
}
