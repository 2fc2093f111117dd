//! f_I = Σ_p k_p S_Ip n (n · (x_p - X_p)): points on springs along the axis n that are fixed to where the points began
//! (Winkler's foundation). k_p = k V0_p, N/m.

use crate::deck::expression::Expression;
use crate::deck::model::Body;
use crate::deck::schema::{AXES, Key, Kind, LOADED, Need, Section, at_least, key, only};
use crate::deck::{Got, Scope, Table, of_body, toml_text};
use crate::error::Result;
use crate::loads::Around;
use crate::points::Points;
use crate::system::in_place::InPlace;
use crate::system::step_points::StepPoints;
use crate::system::terms::Term;
use crate::system::terms::block::add_block;
use crate::system::terms::declaration::{Context, Declaration};
use crate::system::terms::term::{At, Health, Part};

/// Springs below the points of a body, as the deck has them.
#[derive(Debug, Clone, PartialEq)]
pub struct Foundation {
    /// Whose points.
    pub body: usize,
    /// n.
    pub axis: usize,
    /// k, N/m4, a formula of the place at the start.
    pub stiffness: Expression,
}

impl Declaration for Foundation {
    const KEY: Key = {
        let doc = "Springs that hold points where they began.";
        key("foundation", Kind::Tables("foundation"), Need::Optional("none"), doc)
            .read_by(&[LOADED, only("analysis.symmetry", &["plane-strain"])])
    };

    const SECTIONS: &'static [Section] = &[Section {
        name: "foundation",
        header: "[[foundation]]",
        doc: "Winkler's foundation: each point of a body is on a spring along an axis, free of force at the start of the run. Work of the springs counts as work of external forces.",
        keys: &[
            key("body", Kind::Text, Need::Optional("the only body"), "Name of the body."),
            key("axis", Kind::Choice(&AXES), Need::Required, "Direction of the springs."),
            key("stiffness", Kind::Expression("X Y Z"), Need::Required, "Per initial volume. A layer of thickness t on ground of the subgrade modulus k_s (N/m3) has k_s / t; a condition tells where the layer is, as in \"2e6 / 0.25 * (Y < 0.25)\".")
                .unit("N/m4").range(at_least(0.0)),
        ],
    }];

    fn read(table: &Table<'_>, around: &Around<'_>) -> Got<Self> {
        let body = of_body(table, around.names);
        let axis = table.choice_of("axis", &AXES[..around.dimension]);
        let stiffness = table.number_or_expression("stiffness", at_least(0.0))?;
        let stiffness = stiffness.ok_or_else(|| table.missing("stiffness", ""))?;
        Ok(Foundation { body: body?, axis: axis?, stiffness })
    }

    fn written(&self, bodies: &[Body]) -> Vec<(&'static str, String)> {
        vec![
            ("body", toml_text::quote(&bodies[self.body].name)),
            ("axis", toml_text::quote(AXES[self.axis])),
            ("stiffness", toml_text::expression(&self.stiffness)),
        ]
    }

    fn of_body(&self) -> Option<usize> {
        Some(self.body)
    }

    fn may_hold(&self, axis: usize) -> bool {
        axis == self.axis
    }

    fn stiffness<const D: usize>(&self, points: &Points<D>, p: usize) -> [f64; D] {
        let mut along = [0.0; D];
        if points.body[p] as usize == self.body {
            let mut scope = Scope::default();
            scope.initial[..D].copy_from_slice(&points.position_initial[p]);
            along[self.axis] = self.stiffness.value(&scope) * points.volume_initial[p];
        }
        along
    }

    fn make<'a, const D: usize>(&'a self, of: Context<'a, D>) -> Result<Box<dyn Term<D> + 'a>> {
        let (step, axis) = (of.step, self.axis);
        let all = 0..step.points.len();
        let stiffness = all.map(|p| self.stiffness(step.points, p)[axis]).collect();
        Ok(Box::new(Springs { step, axis, stiffness }))
    }
}

/// The springs of one step.
struct Springs<'a, const D: usize> {
    step: StepPoints<'a, D>,
    axis: usize,
    /// k_p of each point, N/m.
    stiffness: Vec<f64>,
}

impl<const D: usize> Springs<'_, D> {
    /// n · (x_p - X_p) at an iterate, m.
    fn stretch(&self, p: usize, at: At<'_>) -> f64 {
        let StepPoints { points, influences, .. } = self.step;
        let start = points.position[p][self.axis] - points.position_initial[p][self.axis];
        let nodes = self.step.nodes_of(p).iter().zip(&influences.weights[influences.row(p)]);
        let moved = nodes.map(|(&node, s)| s * at.displacement[node as usize * D + self.axis]);
        start + moved.sum::<f64>()
    }
}

impl<const D: usize> Term<D> for Springs<'_, D> {
    fn add_shares(
        &self,
        part: Part,
        at: At<'_>,
        force: &mut [f64],
        mut rows: Option<&mut InPlace<'_, D>>,
    ) -> Health {
        let (step, axis) = (self.step, self.axis);
        let mut block = Vec::new();
        // The points of a group have their nodes in common: one dense block for them all.
        for group in step.groups_of(part) {
            let nodes = step.nodes_of_group(group);
            let held = || step.groups.points(group).iter().filter(|&&p| self.stiffness[p] != 0.0);
            if held().next().is_none() {
                continue;
            }
            block.clear();
            block.resize(if rows.is_some() { (nodes.len() * D).pow(2) } else { 0 }, 0.0);
            for &p in held() {
                let weights = &step.influences.weights[step.influences.row(p)];
                let pull = self.stiffness[p] * self.stretch(p, at);
                for (&node, weight) in nodes.iter().zip(weights) {
                    force[node as usize * D + axis] += pull * weight;
                }
                // A row of the block is a component of a node, with D values for each node.
                for (line, of_a) in block.chunks_exact_mut(nodes.len() * D * D).zip(weights) {
                    let line = &mut line[axis * nodes.len() * D..(axis + 1) * nodes.len() * D];
                    for (values, of_b) in line.chunks_exact_mut(D).zip(weights) {
                        values[axis] += self.stiffness[p] * of_a * of_b;
                    }
                }
            }
            if let Some(rows) = rows.as_deref_mut() {
                add_block(at.pattern, group, nodes, &block, rows);
            }
        }
        Health::default()
    }

    /// A stretch carries the round-off of the place.
    fn add_share_sizes(&self, at: At<'_>, size: &mut [f64]) {
        let StepPoints { points, influences, .. } = self.step;
        for p in (0..points.len()).filter(|&p| self.stiffness[p] != 0.0) {
            let reach = points.position[p][self.axis].abs() + self.stretch(p, at).abs();
            let nodes = self.step.nodes_of(p).iter().zip(&influences.weights[influences.row(p)]);
            for (&node, weight) in nodes {
                size[node as usize] += self.stiffness[p] * reach * weight.abs();
            }
        }
    }
}
