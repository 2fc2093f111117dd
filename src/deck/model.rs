//! The deck as typed data: what every other module reads. Units are SI unless said otherwise.
//!
//! Vectors that follow the problem's dimension are `Vec<f64>` of length `Deck::dimension`,
//! already checked; enums carry the deck's own words in `name()`.

use std::path::PathBuf;
use std::sync::Arc;

use super::expression::{Expression, Scope, Variable};
use super::places::Places;
use super::shape::Shape;
use super::solid::Solid;
use super::stage::{Presence, Stage};
use crate::material::{Entry, Parameter};

/// A complete, checked input deck.
#[derive(Debug, Clone, PartialEq)]
pub struct Deck {
    pub title: String,
    /// 2 (plane strain) or 3, from the grid.
    pub dimension: usize,
    /// Folder of the deck: relative paths inside it start here.
    pub directory: PathBuf,
    pub analysis: Analysis,
    /// In order, at least one. `analysis.steps` and `analysis.duration` are their sums.
    pub stages: Vec<Stage>,
    pub method: Method,
    /// What is in force; `None`: nothing is stabilised.
    pub ghost: Option<Ghost>,
    pub grid: Grid,
    pub materials: Vec<Material>,
    pub bodies: Vec<Body>,
    pub boundaries: Vec<Boundary>,
    pub loads: Vec<Load>,
    /// When each load acts, in their order.
    pub load_presence: Vec<Presence>,
    pub rigids: Vec<Rigid>,
    pub contacts: Vec<Contact>,
    pub verify: Vec<Verify>,
    pub probes: Vec<Probe>,
    pub output: Output,
    pub parallel: Parallel,
    /// `[conditioning] displacement`, m: total rigid motion over the analysis.
    pub conditioning_displacement: Option<Vec<f64>>,
    /// `[element_test]`; then the deck has no grid and no bodies.
    pub element_test: Option<ElementTest>,
    /// `[petsc]`: option name without its dash, and value ("" for a bare flag).
    pub petsc: Vec<(String, String)>,
    /// What the user should know of the deck itself, a line each.
    pub notes: Vec<String>,
    /// Where the keys are written.
    pub places: Places,
}

impl Boundary {
    /// How it holds a surface off the grid's nodes, if it does.
    pub fn support(&self) -> Option<&Support> {
        match &self.place {
            Place::Surface(support) => Some(support),
            _ => None,
        }
    }

    /// Whether it may hold a motion along an axis.
    pub fn may_hold(&self, axis: usize) -> bool {
        let of_surface = self.support().is_some_and(|support| {
            support.slip || (self.fix.is_empty() && self.displacement.is_empty())
        });
        of_surface
            || self.fix.contains(&axis)
            || self.displacement.iter().any(|(component, _)| *component == axis)
            || (self.rotation.is_some() && axis < 2)
    }
}

impl Deck {
    /// Whether the deck names stages.
    pub fn is_staged(&self) -> bool {
        self.stages.iter().any(|stage| !stage.name.is_empty())
    }

    /// `[water]`
    pub fn water(&self) -> Option<Water> {
        self.loads.iter().find_map(|load| match load {
            Load::Water(water) => Some(*water),
            _ => None,
        })
    }

    /// Whether a body comes after the start or goes before the end.
    pub fn has_passing_bodies(&self) -> bool {
        let passes = |body: &Body| {
            body.presence.from.is_some_and(|from| from > 0) || body.presence.until.is_some()
        };
        self.bodies.iter().any(passes)
    }

    /// The files that the deck names: points of bodies, the mesh.
    pub fn files(&self) -> Vec<PathBuf> {
        let points = self.bodies.iter().filter_map(|body| match &body.source {
            BodySource::File(path) => Some(path.clone()),
            _ => None,
        });
        let mesh = match &self.grid {
            Grid::Mesh(MeshGrid { source: MeshSource::File(path), .. }) => Some(path.clone()),
            _ => None,
        };
        points.chain(mesh).collect()
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AnalysisType {
    QuasiStatic,
    Explicit,
    ImplicitDynamic,
    Conditioning,
    /// Quasi-static, then with less and less strength.
    StrengthReduction,
    ElementTest,
}

impl AnalysisType {
    /// Whether forces are in balance at the end of every step.
    pub fn is_static(self) -> bool {
        matches!(self, AnalysisType::QuasiStatic | AnalysisType::StrengthReduction)
    }

    /// Whether there is a time `t`, or only the load factor `s`.
    pub fn has_time(self) -> bool {
        matches!(self, AnalysisType::Explicit | AnalysisType::ImplicitDynamic)
    }
}

/// What is done to the one point of an element test.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementTest {
    /// Index into `Deck::materials`.
    pub material: usize,
    pub path: ElementPath,
    /// Pa, compression positive: isotropic stress at the start.
    pub confining: f64,
    /// Axial logarithmic strain at the end, compression positive, or the amount of shear.
    pub strain: f64,
    /// Of each leg of a history; of the whole test otherwise.
    pub steps: usize,
    /// Ends of the legs of `ElementPath::Strain`: principal logarithmic strains, tension positive.
    pub history: Vec<[f64; 3]>,
}

impl ElementTest {
    /// Steps of the whole test.
    pub fn total_steps(&self) -> usize {
        self.steps * self.history.len().max(1)
    }

    /// Strains after a step of the history.
    pub fn history_at(&self, step: usize) -> [f64; 3] {
        let leg = (step.max(1) - 1) / self.steps;
        let from = if leg == 0 { [0.0; 3] } else { self.history[leg - 1] };
        let share = (step - leg * self.steps) as f64 / self.steps as f64;
        [0, 1, 2].map(|a| from[a] + share * (self.history[leg][a] - from[a]))
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ElementPath {
    TriaxialDrained,
    TriaxialUndrained,
    Oedometer,
    Isotropic,
    SimpleShear,
    Biaxial,
    Strain,
}

/// What a problem in two dimensions stands for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Symmetry {
    /// A slice of unit thickness that cannot stretch along z.
    #[default]
    PlaneStrain,
    /// Half of a section through a body of revolution: x is the radius, y the axis. Volumes, masses,
    /// forces and energies are those of the whole turn.
    Axisymmetric,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Analysis {
    pub kind: AnalysisType,
    pub symmetry: Symmetry,
    /// Equal load steps or time steps; `None` only with `cfl`.
    pub steps: Option<usize>,
    /// s; dynamics only.
    pub duration: Option<f64>,
    /// Fraction of the stability limit; explicit only, instead of `steps`.
    pub cfl: Option<f64>,
    /// Normalised residual (Lagrangian eq. 40), default 1e-9.
    pub tolerance: f64,
    /// Evaluations of the residual allowed in one step, the first at zero displacement included.
    pub max_iterations: usize,
    pub on_failure: OnFailure,
    /// With `on_failure = "cut"`: the smallest step, as a fraction of the nominal one (default 1/1024).
    pub smallest_step: f64,
    pub inverted_iterates: InvertedIterates,
    pub tangent: Tangent,
    /// Implicit dynamics: Newmark beta, gamma; or HHT alpha in [-1/3, 0] which sets both.
    pub newmark_beta: f64,
    pub newmark_gamma: f64,
    pub hht_alpha: f64,
    /// Strength reduction: width of the bracket around the factor, relative.
    pub strength_tolerance: f64,
    /// Of dynamics.
    pub damping: Option<Damping>,
}

/// What slows the nodes of a dynamic run down beside the materials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Damping {
    /// Share of the out-of-balance force that acts against the velocity, component by component.
    pub local: f64,
    /// Force against the velocity per momentum, 1/s.
    pub mass: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OnFailure {
    Stop,
    Cut,
}

/// How the tangent of implicit steps is kept and solved with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tangent {
    /// As symmetric where all materials and loads have a symmetric one.
    Auto,
    /// As unsymmetric, whatever they say.
    Unsymmetric,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InvertedIterates {
    Reject,
    Allow,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Method {
    pub basis: Basis,
    pub domain_update: DomainUpdate,
    pub gimp_edge: GimpEdge,
    pub point_volume: PointVolume,
    pub locking: Locking,
    pub frame: Frame,
    pub mass: Mass,
    pub stress_update: StressUpdate,
    pub position_update: PositionUpdate,
    /// FLIP share: 1 is FLIP, 0 is PIC.
    pub flip: f64,
    /// `velocity_update = "xpic"` with `xpic_order = m`; `None` otherwise.
    pub xpic: Option<usize>,
    /// `velocity_update = "apic"` or `"tpic"`; `None` otherwise.
    pub affine: Option<AffineTransfer>,
    /// A node whose summed basis weight is below this fraction of the largest one is held at
    /// zero and left out of the residual (default 1e-8 without Ghost stiffness, 0 with it).
    pub drop_below: f64,
}

/// Which of the two a point keeps while it moves: see [`crate::transfer::affine`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AffineTransfer {
    /// Its affine moment: the angular momentum.
    Apic,
    /// Its velocity gradient: a rigid rotation.
    Tpic,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Basis {
    Mpm,
    Gimp,
    Cpdi1,
    Cpdi2,
}

/// How a GIMP domain follows the deformation (Lagrangian §6.4).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DomainUpdate {
    None,
    Det,
    Normal,
    Stretch,
    Corners,
    NormalCorrected,
    NormalIncremental,
}

/// What stresses are integrated over: the two differ where a domain's size does not follow det F.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum PointVolume {
    /// det F V0
    #[default]
    Deformation,
    /// That of the GIMP domain, as in the program behind Lagrangian §7.
    Domain,
}

/// What keeps points from locking where the volume can hardly change.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Locking {
    #[default]
    None,
    /// Stress from dF_bar = (det dF_0 / det dF)^(1/n) dF, dF_0 that of the cells.
    FBar,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Frame {
    Previous,
    Updated,
    Total,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mass {
    Consistent,
    Lumped,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StressUpdate {
    Usf,
    Usl,
    Musl,
}

/// Functions of a GIMP domain that sticks out of the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GimpEdge {
    /// Those of the outer cell go on: their sum stays one.
    Continued,
    /// Hats of the grid's own nodes alone: what a node beyond the edge would hold is lost.
    Published,
}

/// What moves the points of an explicit step with a Ghost mass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PositionUpdate {
    /// The velocity that keeps the angular momentum.
    Momentum,
    /// The updated nodal velocity (Ghost eq. 9).
    Published,
}

/// Ghost stabilisation parameters. Absolute values win over factors.
#[derive(Debug, Clone, PartialEq)]
pub struct Ghost {
    /// gamma_K, Pa.
    pub stiffness: Option<f64>,
    /// gamma_K as a multiple of each body's Young's modulus.
    pub stiffness_factor: Option<f64>,
    /// gamma_M, kg/m3.
    pub mass: Option<f64>,
    /// gamma_M as a multiple of each body's density.
    pub mass_factor: Option<f64>,
    pub scaling: GhostScaling,
}

impl Ghost {
    /// gamma_K over Young's modulus where the deck says nothing: docs/evidence/ghost-factors.md.
    pub const STIFFNESS_FACTOR: f64 = 0.01;
    /// gamma_M over the density where the deck says nothing (Ghost §5.1).
    pub const MASS_FACTOR: f64 = 0.25;
    /// The same in implicit dynamics, where each step takes half of dv (M~ - M) dv from the energy:
    /// 0.25 would cost a bar of sixteen cells a third of it in four periods.
    pub const IMPLICIT_MASS_FACTOR: f64 = 0.01;
}

/// Scale of the face matrix: numerics of the default and of the papers' tables differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GhostScaling {
    ScaleFree,
    Literal,
    Published,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Grid {
    Lattice(LatticeGrid),
    Mesh(MeshGrid),
}

#[derive(Debug, Clone, PartialEq)]
pub struct LatticeGrid {
    /// m
    pub origin: Vec<f64>,
    /// m, one per axis
    pub spacing: Vec<f64>,
    /// cells per axis
    pub cells: Vec<usize>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct MeshGrid {
    pub source: MeshSource,
    pub motion: MeshMotion,
}

#[derive(Debug, Clone, PartialEq)]
pub enum MeshSource {
    /// Gmsh file, absolute or relative to the deck's folder (already joined).
    File(PathBuf),
    /// Circular (inner = [r, r]) or elliptic hole in a disc of radius `outer`, m.
    /// `grading` >= 1 refines around the ends of the long axis (1: uniform).
    Annulus {
        inner: [f64; 2],
        outer: f64,
        radial: usize,
        around: usize,
        element: Element,
        grading: f64,
    },
    Box {
        min: Vec<f64>,
        max: Vec<f64>,
        cells: Vec<usize>,
        element: Element,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Element {
    Tri3,
    Quad4,
    Tet4,
    Hex8,
}

#[derive(Debug, Clone, PartialEq)]
pub enum MeshMotion {
    Fixed,
    /// Rigid rotation with the named boundary tag's prescribed rotation.
    RotateWith(String),
    /// Nodes follow the computed displacement along these axes (0, 1, 2) only.
    Follow(Vec<usize>),
    /// Nodes follow the material wholly: updated-Lagrangian FEM with `gauss` seeding.
    Material,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    pub name: String,
    pub model: &'static Entry,
    /// One per parameter of the model: a number or a formula of X, Y, Z; `None` where the deck
    /// leaves it out.
    pub parameters: Vec<Option<Expression>>,
    /// Size of the grid's cells, m: how wide a band of softening material is. 0 without a grid.
    pub cell: f64,
}

impl Material {
    /// Whether a parameter depends on the place.
    pub fn varies(&self) -> bool {
        self.parameters.iter().flatten().any(|value| value.as_constant().is_none())
    }

    /// The model with the parameters that hold at a place.
    pub fn at(&self, scope: &Scope) -> crate::material::Material {
        (self.model.make)(&self.values(scope))
    }

    /// Whether the model has a strength that can be reduced.
    pub fn has_strength(&self) -> bool {
        let mut given = self.model.parameters.iter().zip(&self.parameters);
        given.any(|(known, value)| value.is_some() && strength_of(known.key).is_some())
    }

    /// Divides the strength among `values`, in the order of the model's parameters, by a factor:
    /// stresses, and tangents of angles.
    pub fn weaken(&self, values: &mut [f64], factor: f64) {
        for (known, value) in self.model.parameters.iter().zip(values) {
            match strength_of(known.key) {
                Some(Strength::Stress) => *value /= factor,
                Some(Strength::Angle) => {
                    *value = (value.to_radians().tan() / factor).atan().to_degrees();
                }
                None => {}
            }
        }
    }

    /// The parameters at a place, in the order of the model's; the strain of softening is brought from
    /// its length to the grid's cells.
    pub fn values(&self, scope: &Scope) -> Vec<f64> {
        let given = self.parameters.iter().zip(self.model.parameters);
        let value = |(value, known): (&Option<Expression>, &Parameter)| match value {
            Some(value) => value.value(scope),
            None => known.value_if_absent(),
        };
        let mut values: Vec<f64> = given.map(value).collect();
        let place = |key: &str| self.model.parameters.iter().position(|known| known.key == key);
        if let (Some(strain), Some(length)) = (place("softening.strain"), place("softening.length"))
            && self.cell > 0.0
        {
            values[strain] *= values[length] / self.cell;
        }
        values
    }
}

enum Strength {
    Stress,
    Angle,
}

/// What a key of a material is to a strength reduction.
fn strength_of(key: &str) -> Option<Strength> {
    match key.rsplit('.').next().unwrap_or(key) {
        "cohesion" | "tension" | "shear_strength" | "yield" | "yield_stress" => {
            Some(Strength::Stress)
        }
        "friction" | "dilation" => Some(Strength::Angle),
        _ => None,
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    pub name: String,
    /// Index into `Deck::materials`.
    pub material: usize,
    /// kg/m3, initial
    pub density: f64,
    pub source: BodySource,
    /// m/s, one expression per axis of X, Y, Z.
    pub velocity: Vec<Expression>,
    /// `overlap = "allow"`: it may lie where another body lies.
    pub may_overlap: bool,
    pub initial_stress: Option<InitialStress>,
    pub presence: Presence,
}

/// Effective Cauchy stress of a body before the first step, Pa, tension positive.
#[derive(Debug, Clone, PartialEq)]
pub enum InitialStress {
    /// xx, yy, zz, xy, yz, xz: expressions of X, Y, Z.
    Components(Box<[Expression; 6]>),
    /// Weight of what lies above, and a share of it to the sides.
    K0(Box<K0>),
}

/// Expressions of X, Y, Z, but for the axis.
#[derive(Debug, Clone, PartialEq)]
pub struct K0 {
    /// N/m3, saturated where there is water.
    pub unit_weight: Expression,
    /// Height of the surface along the axis, m.
    pub surface: Expression,
    /// Horizontal over vertical effective stress.
    pub k0: Expression,
    /// On the surface, Pa.
    pub surcharge: Expression,
    /// The vertical one.
    pub axis: usize,
}

#[derive(Debug, Clone, PartialEq)]
pub enum BodySource {
    Shape {
        shape: Shape,
        seeding: Seeding,
    },
    /// csv with header `x,y[,z],volume[,vx,vy,vz]`; path already joined to the deck's folder.
    File(PathBuf),
    /// All cells of a mesh, or those with this physical tag.
    MeshCells {
        tag: Option<String>,
        seeding: Seeding,
    },
}

#[derive(Debug, Clone, PartialEq)]
pub enum Seeding {
    /// Equal sub-cells per grid cell, per axis; on a mesh the equivalent number per element.
    PerCell(Vec<usize>),
    /// Points at offset + (i, j, k) * spacing, m, kept where the centre is inside the shape;
    /// volume spacing^D. Offset is a position in the shape's local frame (before `translate`).
    Lattice { spacing: f64, offset: Vec<f64> },
    /// Gauss points per axis and cell.
    Gauss(usize),
}

#[derive(Debug, Clone, PartialEq)]
pub struct Boundary {
    pub name: String,
    pub place: Place,
    /// Component -> held at zero.
    pub fix: Vec<usize>,
    /// (component, total displacement over the analysis, m, expression of X, Y, Z, s, t).
    /// A value without `s` or `t` is ramped linearly with the load factor.
    pub displacement: Vec<(usize, Expression)>,
    /// Total rigid rotation over the analysis.
    pub rotation: Option<Rotation>,
    pub presence: Presence,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Rotation {
    /// m
    pub centre: Vec<f64>,
    /// Total, counter-clockwise about z.
    pub degrees: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Place {
    /// A face of the lattice: axis and whether it is the upper end.
    /// left/right: x; bottom/top: y; back/front: z.
    Side { axis: usize, upper: bool },
    /// Nodes inside or on a box (tolerance 1e-9 of the grid spacing), in start positions.
    Box { min: Vec<f64>, max: Vec<f64> },
    /// Nodes of a mesh tag.
    Tag(String),
    /// All nodes of the cells that hold the outermost points of a body (Lagrangian §7.2),
    /// recomputed every step.
    CellsOf { body: usize },
    /// No nodes: a surface that a penalty holds, wherever it lies on the grid.
    Surface(Support),
}

/// A surface that is held off the grid's nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Support {
    pub surface: Held,
    /// Its normal component alone is held.
    pub slip: bool,
    /// Force per area and per distance, times h over the body's stiffness.
    pub penalty: f64,
    pub method: SupportMethod,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SupportMethod {
    Penalty,
    /// The material's own traction, and a penalty for what is left.
    Nitsche,
}

/// What a [`Support`] holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Held {
    /// A part of a body's own surface.
    Surface(BodySurface),
    /// The material on a line between two places (2D), or on a parallelogram given by three of its
    /// corners, the first between the others (3D), at the start, m.
    Sheet(Vec<Vec<f64>>),
}

/// A part of the surface of a body that is given as a shape, at the start.
#[derive(Debug, Clone, PartialEq)]
pub struct BodySurface {
    pub body: usize,
    /// Axis and whether it is the upper end: where the outward normal, in the frame of the shape, is
    /// nearest to this direction. `None`: everywhere.
    pub side: Option<(usize, bool)>,
    /// Condition on x, y, z at the start; `None`: everywhere.
    pub within: Option<Expression>,
}

/// In quasi-static runs values that hold neither `s` nor `t` are ramped with the load factor.
#[derive(Debug, Clone, PartialEq)]
pub enum Load {
    /// Total force, N (2D: N/m), expressions of s and t, shared equally by the points nearest to
    /// the given places.
    Point { body: usize, nearest: Vec<Vec<f64>>, force: Vec<Expression> },
    /// m/s2, expressions of X, Y, Z, s, t.
    Gravity(Vec<Expression>),
    /// N/m3 of *initial* volume, expressions of X, Y, Z, x, y, z, s, t.
    BodyForce(Vec<Expression>),
    /// Pa, an expression of x, y, z, s, t: a pressure on the surface of all bodies.
    Pressure { value: Expression, zone: Option<PressureZone> },
    /// Pa, an expression of x, y, z, s, t: a pressure on a body's own surface.
    SurfacePressure { surface: BodySurface, value: Expression },
    /// Pa per initial area, expressions of X, Y, Z, s, t: a traction on a body's own surface.
    Traction { surface: BodySurface, value: Vec<Expression> },
    /// Given pore water, of `[water]`: it lifts what is below its level.
    Water(Water),
    /// Body force (N per initial volume) that makes this displacement field exact: one expression
    /// per axis of X, Y, Z, s (manufactured solution).
    Manufactured(Vec<Expression>),
}

impl Load {
    /// Whether a value of it depends on s or t.
    pub fn depends_on_time(&self) -> bool {
        match self {
            Load::Pressure { value, .. } | Load::SurfacePressure { value, .. } => {
                value.depends_on_time()
            }
            Load::Point { force: all, .. }
            | Load::Gravity(all)
            | Load::Traction { value: all, .. }
            | Load::BodyForce(all)
            | Load::Manufactured(all) => all.iter().any(Expression::depends_on_time),
            Load::Water(_) => false,
        }
    }

    /// The body that it acts on alone.
    pub fn body(&self) -> Option<usize> {
        match self {
            Load::Point { body, .. } => Some(*body),
            Load::Traction { surface, .. } | Load::SurfacePressure { surface, .. } => {
                Some(surface.body)
            }
            _ => None,
        }
    }

    /// Whether it may resist a motion along an axis: a pressure that varies along it.
    pub fn may_hold(&self, axis: usize) -> bool {
        const PLACE: [Variable; 3] = [Variable::CurrentX, Variable::CurrentY, Variable::CurrentZ];
        match self {
            Load::Pressure { value, zone } => zone.is_some() || value.depends_on(PLACE[axis]),
            _ => false,
        }
    }
}

/// Still water in the pores and around the bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Water {
    /// m, along the axis.
    pub level: f64,
    /// N/m3
    pub unit_weight: f64,
    /// The vertical one.
    pub axis: usize,
}

impl Water {
    /// p = unit_weight (level - height), 0 above, Pa.
    pub fn pressure(&self, x: &[f64]) -> f64 {
        self.unit_weight * (self.level - x[self.axis]).max(0.0)
    }
}

/// Where a pressure acts in full, in current positions.
#[derive(Debug, Clone, PartialEq)]
pub struct PressureZone {
    pub min: Vec<f64>,
    pub max: Vec<f64>,
    /// Width over which it falls to zero outside, m; `None`: three cells.
    pub fade: Option<f64>,
}

/// A rigid body.
#[derive(Debug, Clone, PartialEq)]
pub struct Rigid {
    pub name: String,
    pub shape: RigidShape,
    pub motion: RigidMotion,
    /// It moves freely.
    pub free: Option<FreeRigid>,
}

/// What moves a rigid body in place of the deck.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeRigid {
    /// kg/m3
    pub density: f64,
    /// m/s, at the start.
    pub velocity: Vec<f64>,
}

/// The surface of a rigid body, m.
#[derive(Debug, Clone, PartialEq)]
pub enum RigidShape {
    /// `normal` points out of it and may be of any length.
    HalfSpace {
        point: Vec<f64>,
        normal: Vec<f64>,
    },
    Ball {
        centre: Vec<f64>,
        radius: f64,
    },
    Box {
        min: Vec<f64>,
        max: Vec<f64>,
    },
    Capsule {
        from: Vec<f64>,
        to: Vec<f64>,
        radius: f64,
    },
    /// 2D.
    Polygon {
        corners: Vec<[f64; 2]>,
    },
    /// 3D.
    Solid(Arc<Solid>),
    /// 3D; `axis` points from the tip into it, `angle` is that at the tip, degrees.
    Cone {
        tip: [f64; 3],
        axis: [f64; 3],
        angle: f64,
        radius: f64,
        shaft: f64,
    },
}

/// How a rigid body is driven; without anything it is held.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RigidMotion {
    /// m, one per axis, of s and t; empty: none.
    pub displacement: Vec<Expression>,
    /// m/s, one per axis, of t; empty: none.
    pub velocity: Vec<Expression>,
    pub rotation: Option<RigidRotation>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct RigidRotation {
    /// m; moves along with the body.
    pub centre: Vec<f64>,
    /// Direction, any length; z in 2D.
    pub axis: [f64; 3],
    /// Of s and t, right-handed.
    pub degrees: Expression,
}

/// A body on a rigid body.
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    pub name: String,
    /// Index into `Deck::rigids`.
    pub rigid: usize,
    /// Index into `Deck::bodies`.
    pub body: usize,
    pub friction: Friction,
    /// Pa
    pub adhesion: f64,
    /// Pa
    pub max_shear: Option<f64>,
    /// Times the body's stiffness over the cell size.
    pub penalty: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Friction {
    /// Coefficient.
    Coulomb(f64),
    /// No slip.
    Rough,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Verify {
    pub name: String,
    /// e.g. `stress.yy`, `displacement.x`, `displacement`, `velocity.x`, `J`.
    pub field: String,
    /// One expression, or one per component for a vector field.
    pub exact: Vec<Expression>,
    pub norm: VerifyNorm,
    pub scale: f64,
}

/// `[[probe]]`
#[derive(Debug, Clone, PartialEq)]
pub struct Probe {
    pub name: String,
    pub spot: Spot,
    /// Fields or components, as written: `displacement`, `stress.yy`.
    pub fields: Vec<String>,
}

/// What a probe follows.
#[derive(Debug, Clone, PartialEq)]
pub enum Spot {
    /// The point, of all or of one body, that is nearest to a place (m) at the start.
    Near {
        place: Vec<f64>,
        body: Option<usize>,
    },
    Id(u64),
    /// The mean over a body.
    Mean(usize),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VerifyNorm {
    /// sum |a - b| V0 / (scale V0_total), Lagrangian eq. 42.
    VolumeL1,
    /// sqrt(sum |a - b|^2 V0 / V0_total) / scale
    VolumeL2,
    /// max |a - b| / scale
    Max,
}

/// Readers of frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// XDMF beside the HDF5 files.
    Xdmf,
    /// The HDF5 files of the points are VTKHDF files as well.
    VtkHdf,
    /// VTK files of the points, too.
    Vtu,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    pub every: Every,
    /// Between rows of the history.
    pub history: Every,
    /// Between lines on the terminal and in the log; seconds of wall time. By default one a second
    /// in explicit analyses, whose steps are short, and one a step in others.
    pub log: Every,
    /// Point fields to write.
    pub fields: Vec<String>,
    pub checkpoint: Option<Checkpoint>,
    /// For whom the frames are prepared.
    pub formats: Vec<Format>,
    /// `report.html` at the end of the run.
    pub report: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Every {
    Steps(usize),
    /// s of simulated time
    Seconds(f64),
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Checkpoint {
    /// Steps between checkpoints, if any.
    pub every: Option<usize>,
    /// Minutes of wall time between checkpoints, if any.
    pub minutes: Option<f64>,
    /// How many to keep (default 2).
    pub keep: usize,
}

/// How the first partition is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Initial {
    Balanced,
    /// Equal slices of the grid, for comparison.
    Slabs,
}

/// What a point costs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cost {
    /// One: partitions, and so results, repeat bit by bit.
    Points,
    /// The seconds that its rank spends, smoothed: follows uneven machines and materials.
    Time,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parallel {
    pub initial: Initial,
    /// What is levelled.
    pub cost: Cost,
    /// Cells per side of a lattice brick, the unit of partition; `None`: chosen by size.
    pub brick: Option<usize>,
    /// Repartition when max/mean cost exceeds this (default 1.1); 0 switches it off.
    pub rebalance_above: f64,
}
