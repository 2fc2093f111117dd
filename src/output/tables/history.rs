//! `history.csv`: one row per finished step, the header `name [unit]`.

use mpi::topology::SimpleCommunicator;

use super::csv_table::CsvTable;
use crate::deck::model::{Contact, Partner};
use crate::error::Result;
use crate::output::directory::{HISTORY, ResultsDirectory};

/// What a run's history holds besides the columns that every run has.
#[derive(Debug, Clone, Default)]
pub struct HistoryColumns {
    /// 2 or 3: plane strain has its forces, energies and momenta per metre of thickness.
    pub dimension: usize,
    /// Two dimensions stand for a whole body, not for a slice of it: axisymmetry.
    pub whole: bool,
    /// Names of the deck's boundary entries, in deck order.
    pub boundaries: Vec<String>,
    /// Names of the deck's rigid bodies and contacts, in deck order.
    pub rigids: Vec<String>,
    /// Names of the rigid bodies that move freely, in deck order.
    pub free: Vec<String>,
    pub contacts: Vec<ContactName>,
    /// A conditioning run.
    pub conditioning: bool,
    /// The deck names stages.
    pub staged: bool,
    /// The deck damps.
    pub damped: bool,
    /// A strength reduction.
    pub reduced: bool,
}

/// A contact of the deck.
#[derive(Debug, Clone, Default)]
pub struct ContactName {
    pub name: String,
    /// It is one of two bodies, which have no reaction columns.
    pub of_bodies: bool,
}

impl ContactName {
    pub fn of(contact: &Contact) -> Self {
        let of_bodies = matches!(contact.partner, Partner::Body(_));
        ContactName { name: contact.name.clone(), of_bodies }
    }
}

/// Name and unit of a column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    pub name: String,
    pub unit: &'static str,
}

/// One row. Numbers of all ranks together; those that an analysis does not know stay at zero.
#[derive(Debug, Clone, Default)]
pub struct HistoryRow {
    pub step: usize,
    /// From zero.
    pub stage: usize,
    /// s of the stage.
    pub load_factor: f64,
    /// What the strength is divided by.
    pub strength_factor: f64,
    /// s
    pub time: f64,
    /// s
    pub dt: f64,
    pub newton_iterations: usize,
    /// Normalised residual of the last iteration.
    pub residual: f64,
    pub linear_iterations: usize,
    pub energy_kinetic: f64,
    pub energy_strain: f64,
    /// Dissipated by plastic flow so far.
    pub energy_plastic: f64,
    pub energy_ghost: f64,
    /// Work of loads and moved boundaries so far.
    pub work_external: f64,
    /// What damping has taken so far.
    pub dissipation_damping: f64,
    pub momentum: [f64; 3],
    /// About the origin.
    pub angular_momentum: [f64; 3],
    /// One per entry of [`HistoryColumns::boundaries`].
    pub reactions: Vec<Reaction>,
    /// One per entry of [`HistoryColumns::rigids`]: what it exerts; it holds nothing.
    pub rigids: Vec<Reaction>,
    /// One per entry of [`HistoryColumns::free`].
    pub free: Vec<FreeState>,
    /// One per entry of [`HistoryColumns::contacts`].
    pub contacts: Vec<ContactState>,
    /// In the penalties of contacts.
    pub energy_contact: f64,
    /// Dissipated by friction so far.
    pub dissipation_friction: f64,
    /// Lost by bodies that meet so far.
    pub dissipation_impact: f64,
    pub ghost_faces: usize,
    pub populated_cells: usize,
    /// Step cuts so far.
    pub cuts: usize,
    /// Largest cost of a rank over the mean.
    pub imbalance: f64,
    /// Share of the points that changed rank at the end of the step.
    pub moved_points: f64,
    /// s since the start of the run.
    pub wall_seconds: f64,
    /// For [`HistoryColumns::conditioning`].
    pub conditioning: Conditioning,
}

/// What a named boundary holds.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Reaction {
    pub force: [f64; 3],
    /// Sum of the magnitudes of the nodal forces.
    pub sum_abs: f64,
    /// About the boundary's centre of rotation, or the origin.
    pub torque: f64,
    /// Volume of the material that its nodes hold, m3 (m2 in plane strain).
    pub held: f64,
}

/// A contact at the end of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ContactState {
    /// m2 (m in 2D)
    pub area: f64,
    /// So far, the mean over the area in contact, m.
    pub slip: f64,
    /// Depth of the deepest corner, or overlap of two bodies, m.
    pub gap_max: f64,
    /// Of the first of two bodies on the second, N.
    pub force: [f64; 3],
}

/// A rigid body that moves freely, at the end of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FreeState {
    /// Centre of mass, m.
    pub centre: [f64; 3],
    /// m/s
    pub velocity: [f64; 3],
    /// 1/s
    pub spin: [f64; 3],
    /// Kinetic, J.
    pub energy: f64,
}

/// Condition numbers and stability limits of one position of the bodies.
#[derive(Debug, Clone, Copy, Default)]
pub struct Conditioning {
    pub kappa_mass: f64,
    pub kappa_mass_ghost: f64,
    pub kappa_mass_lumped: f64,
    pub kappa_stiffness: f64,
    pub kappa_stiffness_ghost: f64,
    pub cfl: f64,
    pub cfl_ghost: f64,
    pub velocity_error: f64,
    pub velocity_error_ghost: f64,
}

/// Name, unit and value of every column: the one place where they are paired.
fn cells(layout: &HistoryColumns, row: &HistoryRow) -> Vec<(Column, f64)> {
    let plane = layout.dimension == 2 && !layout.whole;
    let unit = |volume, area| if plane { area } else { volume };
    let (force, energy) = (unit("N", "N/m"), unit("J", "J/m"));
    let (momentum, angular) = (unit("kg m/s", "kg/s"), unit("kg m2/s", "kg m/s"));
    let torque = unit("N m", "N");
    let axes = ["x", "y", "z"];

    let mut cells = Vec::new();
    let mut cell = |name: String, unit, value| cells.push((Column { name, unit }, value));
    cell("step".into(), "-", row.step as f64);
    if layout.staged {
        cell("stage".into(), "-", (row.stage + 1) as f64);
    }
    cell("load_factor".into(), "-", row.load_factor);
    if layout.reduced {
        cell("strength_factor".into(), "-", row.strength_factor);
    }
    cell("time".into(), "s", row.time);
    cell("dt".into(), "s", row.dt);
    cell("newton_iterations".into(), "-", row.newton_iterations as f64);
    cell("residual".into(), "-", row.residual);
    cell("linear_iterations".into(), "-", row.linear_iterations as f64);
    cell("energy_kinetic".into(), energy, row.energy_kinetic);
    cell("energy_strain".into(), energy, row.energy_strain);
    cell("energy_plastic".into(), energy, row.energy_plastic);
    cell("energy_ghost".into(), energy, row.energy_ghost);
    cell("work_external".into(), energy, row.work_external);
    if layout.damped {
        cell("dissipation_damping".into(), energy, row.dissipation_damping);
    }
    for (axis, value) in axes.iter().zip(row.momentum) {
        cell(format!("momentum_{axis}"), momentum, value);
    }
    for (axis, value) in axes.iter().zip(row.angular_momentum) {
        cell(format!("angular_momentum_{axis}"), angular, value);
    }
    let all = [(&layout.boundaries, &row.reactions, true), (&layout.rigids, &row.rigids, false)];
    for (names, reactions, hold) in all {
        for (index, name) in names.iter().enumerate() {
            let reaction = reactions.get(index).copied().unwrap_or_default();
            for (axis, value) in axes.iter().zip(reaction.force).take(layout.dimension) {
                cell(format!("reaction.{name}.{axis}"), force, value);
            }
            cell(format!("reaction.{name}.sum_abs"), force, reaction.sum_abs);
            cell(format!("reaction.{name}.torque"), torque, reaction.torque);
            if hold {
                cell(format!("reaction.{name}.held"), unit("m3", "m2"), reaction.held);
            }
        }
    }
    for (index, ContactName { name, of_bodies }) in layout.contacts.iter().enumerate() {
        let state = row.contacts.get(index).copied().unwrap_or_default();
        if *of_bodies {
            for (axis, value) in axes.iter().zip(state.force).take(layout.dimension) {
                cell(format!("contact.{name}.{axis}"), force, value);
            }
        }
        cell(format!("contact.{name}.area"), unit("m2", "m"), state.area);
        cell(format!("contact.{name}.slip"), "m", state.slip);
        cell(format!("contact.{name}.gap_max"), "m", state.gap_max);
    }
    for (index, name) in layout.free.iter().enumerate() {
        let state = row.free.get(index).copied().unwrap_or_default();
        let along = || axes.iter().enumerate().take(layout.dimension);
        for (a, axis) in along() {
            cell(format!("rigid.{name}.{axis}"), "m", state.centre[a]);
        }
        for (a, axis) in along() {
            cell(format!("rigid.{name}.velocity_{axis}"), "m/s", state.velocity[a]);
        }
        let turns = if plane { 2..3 } else { 0..3 };
        for (a, axis) in axes.iter().enumerate().filter(|(a, _)| turns.contains(a)) {
            cell(format!("rigid.{name}.spin_{axis}"), "1/s", state.spin[a]);
        }
        cell(format!("rigid.{name}.energy"), energy, state.energy);
    }
    if !layout.contacts.is_empty() {
        cell("energy_contact".into(), energy, row.energy_contact);
        cell("dissipation_friction".into(), energy, row.dissipation_friction);
        if layout.contacts.iter().any(|contact| contact.of_bodies) {
            cell("dissipation_impact".into(), energy, row.dissipation_impact);
        }
    }
    cell("ghost_faces".into(), "-", row.ghost_faces as f64);
    cell("populated_cells".into(), "-", row.populated_cells as f64);
    cell("cuts".into(), "-", row.cuts as f64);
    cell("imbalance".into(), "-", row.imbalance);
    cell("moved_points".into(), "-", row.moved_points);
    cell("wall_seconds".into(), "s", row.wall_seconds);
    if layout.conditioning {
        let c = &row.conditioning;
        cell("kappa_mass".into(), "-", c.kappa_mass);
        cell("kappa_mass_ghost".into(), "-", c.kappa_mass_ghost);
        cell("kappa_mass_lumped".into(), "-", c.kappa_mass_lumped);
        cell("kappa_stiffness".into(), "-", c.kappa_stiffness);
        cell("kappa_stiffness_ghost".into(), "-", c.kappa_stiffness_ghost);
        cell("cfl".into(), "-", c.cfl);
        cell("cfl_ghost".into(), "-", c.cfl_ghost);
        cell("velocity_error".into(), "m/s", c.velocity_error);
        cell("velocity_error_ghost".into(), "m/s", c.velocity_error_ghost);
    }
    cells
}

/// The open history of a run.
#[derive(Debug)]
pub struct History {
    layout: HistoryColumns,
    pub table: CsvTable,
}

impl History {
    /// A new history. Nothing is written before [`CsvTable::open`].
    pub fn create(directory: &ResultsDirectory, layout: HistoryColumns) -> Result<Self> {
        let table = CsvTable::create(&directory.file(HISTORY), &header(&layout))?;
        Ok(Self { layout, table })
    }

    /// Appends a row; it is on its way to the disk when this returns.
    pub fn push(&mut self, row: &HistoryRow, comm: &SimpleCommunicator) -> Result<()> {
        assert_eq!(row.reactions.len(), self.layout.boundaries.len(), "one reaction per boundary");
        let values: Vec<_> = cells(&self.layout, row).into_iter().map(|(_, v)| v).collect();
        self.table.push(&values, comm)
    }
}

fn header(layout: &HistoryColumns) -> Vec<String> {
    cells(layout, &HistoryRow::default())
        .into_iter()
        .map(|(column, _)| format!("{} [{}]", column.name, column.unit))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_columns_of_a_plane_strain_run() {
        let layout = HistoryColumns {
            dimension: 2,
            boundaries: vec!["root".into()],
            ..HistoryColumns::default()
        };
        assert_eq!(
            header(&layout).join(","),
            "step [-],load_factor [-],time [s],dt [s],newton_iterations [-],residual [-],\
             linear_iterations [-],energy_kinetic [J/m],energy_strain [J/m],energy_plastic [J/m],\
             energy_ghost [J/m],work_external [J/m],momentum_x [kg/s],momentum_y [kg/s],\
             momentum_z [kg/s],angular_momentum_x [kg m/s],angular_momentum_y [kg m/s],\
             angular_momentum_z [kg m/s],reaction.root.x [N/m],reaction.root.y [N/m],\
             reaction.root.sum_abs [N/m],reaction.root.torque [N],reaction.root.held [m2],ghost_faces [-],\
             populated_cells [-],cuts [-],imbalance [-],moved_points [-],\
             wall_seconds [s]"
        );
    }

    #[test]
    fn values_stand_under_their_names() {
        let layout = HistoryColumns {
            dimension: 3,
            whole: false,
            boundaries: vec!["a".into(), "b".into()],
            rigids: vec!["cone".into()],
            free: vec!["ball".into()],
            contacts: vec![ContactName { name: "cone-a".into(), of_bodies: true }],
            conditioning: true,
            staged: true,
            damped: true,
            reduced: true,
        };
        let reaction = Reaction { force: [1.0, 2.0, 3.0], sum_abs: 4.0, torque: 5.0, held: 8.0 };
        let row = HistoryRow {
            step: 12,
            momentum: [0.0, 6.0, 0.0],
            reactions: vec![Reaction::default(), reaction],
            rigids: vec![Reaction { torque: 9.0, ..reaction }],
            contacts: vec![ContactState {
                area: 1.5,
                slip: 2.5,
                gap_max: 3.5,
                force: [0.0, 6.5, 0.0],
            }],
            dissipation_impact: 5.5,
            energy_contact: 4.5,
            conditioning: Conditioning { cfl_ghost: 7.0, ..Default::default() },
            ..Default::default()
        };
        let cells = cells(&layout, &row);
        let value = |name: &str| cells.iter().find(|(c, _)| c.name == name).unwrap().1;
        assert_eq!((value("step"), value("stage")), (12.0, 1.0));
        assert_eq!(value("momentum_y"), 6.0);
        assert_eq!(value("reaction.a.z"), 0.0);
        assert_eq!(value("reaction.b.z"), 3.0);
        assert_eq!(value("reaction.b.torque"), 5.0);
        assert_eq!(value("reaction.b.held"), 8.0);
        assert_eq!((value("reaction.cone.y"), value("reaction.cone.torque")), (2.0, 9.0));
        assert_eq!((value("contact.cone-a.slip"), value("energy_contact")), (2.5, 4.5));
        assert_eq!((value("contact.cone-a.y"), value("dissipation_impact")), (6.5, 5.5));
        assert_eq!(value("cfl_ghost"), 7.0);
    }
}
