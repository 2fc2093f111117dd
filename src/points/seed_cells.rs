//! Points of bodies that fill the cells of a mesh, cell by cell.

use crate::basis::Domain;
use crate::deck::Shape;
use crate::deck::model::{Body, BodySource, Deck, Place, Seeding};
use crate::error::{Error, Result};
use crate::grid::Mesh;
use crate::grid::quadrature::SubCell;

use super::share::Share;
use super::{Points, rectangle_corners};

/// Sub-cells or Gauss points of mesh cells.
pub(crate) struct CellSeeding<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    index: usize,
    pub body: &'a Body,
    seeding: &'a Seeding,
    /// Where in these cells; everywhere without a shape.
    shape: Option<&'a Shape>,
    cells: Vec<usize>,
    at_centroid: bool,
    /// A boundary of the deck asks for the body's outermost points.
    outermost: bool,
}

impl<'a, const D: usize> CellSeeding<'a, D> {
    pub(crate) fn new(
        deck: &'a Deck,
        mesh: &'a Mesh<D>,
        index: usize,
        seeding: &'a Seeding,
    ) -> Result<CellSeeding<'a, D>> {
        let body = &deck.bodies[index];
        if let Seeding::PerCell(counts) = seeding
            && mesh.element.is_simplex()
            && counts.iter().any(|count| count != &counts[0])
        {
            let message = format!(
                "expected one number, found {counts:?}: triangles and tetrahedra are cut parallel to \
                 all their faces, into as many parts along each edge"
            );
            let key = format!("body.{index}.points_per_cell");
            return Err(Error::Input(deck.origins.message(&key, &message)));
        }
        let (shape, tag) = match &body.source {
            BodySource::Shape { shape, .. } => (Some(shape), None),
            BodySource::MeshCells { tag, .. } => (None, tag.as_deref()),
            BodySource::File(_) => unreachable!("a file tells where its points are"),
        };
        let cells = match tag {
            Some(tag) => mesh.tagged_cells(tag)?,
            None => (0..mesh.cell_count()).collect(),
        };
        // The position of a CPDI2 point is the centroid of its domain; others sit where their
        // sub-cell's centre maps to.
        let at_centroid = deck.method.basis.domain() == Domain::Corners;
        let asks = |place: &Place| matches!(place, Place::CellsOf { body } if *body == index);
        let outermost = deck.boundaries.iter().any(|boundary| asks(&boundary.place));
        Ok(CellSeeding { mesh, index, body, seeding, shape, cells, at_centroid, outermost })
    }

    /// Where a part of a cell has its point, if it has one.
    fn place(&self, part: &SubCell<D>) -> Option<[f64; D]> {
        let x = if self.at_centroid { part.centroid } else { part.position };
        self.shape.is_none_or(|shape| shape.contains(&x)).then_some(x)
    }

    /// Whether the points of a cell are the body's outermost: the body does not fill it, or has
    /// nothing behind one of its faces.
    fn is_outermost(&self, cell: usize, parts: &[SubCell<D>]) -> bool {
        if parts.iter().any(|part| self.place(part).is_none()) {
            return true;
        }
        let mut neighbours = Vec::new();
        self.mesh.face_neighbours(cell, &mut neighbours);
        let mut parts = Vec::new();
        neighbours.len() < self.mesh.element.faces().len()
            || neighbours.iter().any(|&neighbour| {
                parts.clear();
                self.split(neighbour, &mut parts);
                self.cells.binary_search(&neighbour).is_err()
                    || parts.iter().all(|part| self.place(part).is_none())
            })
    }

    /// Room for the candidates of a cell: no element makes more than six times n^D sub-cells.
    fn per_cell(&self) -> usize {
        let n = match self.seeding {
            Seeding::PerCell(counts) => counts.iter().copied().max().unwrap_or(1),
            Seeding::Gauss(order) => *order,
            Seeding::Lattice { .. } => unreachable!("a lattice of points is seeded by its shape"),
        };
        6 * n.pow(D as u32)
    }

    pub(crate) fn candidates(&self) -> u64 {
        (self.cells.len() * self.per_cell()) as u64
    }

    /// Makes the points that are inside, in the cells of the share that are wanted.
    pub(crate) fn run(
        &self,
        points: &mut Points<D>,
        share: Share,
        wanted: impl Fn(usize) -> bool,
        first_id: u64,
    ) {
        let per_cell = self.per_cell();
        let candidates =
            || share.of(self.cells.len()).filter(|&candidate| wanted(self.cells[candidate]));
        let mut made = Vec::new();
        if let (None, Some(first)) = (self.shape, candidates().next()) {
            // All cells make as many.
            self.split(self.cells[first], &mut made);
            points.reserve(candidates().count() * made.len());
        }
        for candidate in candidates() {
            made.clear();
            self.split(self.cells[candidate], &mut made);
            let outermost = self.outermost && self.is_outermost(self.cells[candidate], &made);
            for (sub, part) in made.iter().enumerate() {
                let Some(x) = self.place(part) else { continue };
                let half = [0.5 * part.volume.powf(1.0 / D as f64); D];
                let (id, density) =
                    (first_id + (candidate * per_cell + sub) as u64, self.body.density);
                points.push_unstrained(id, self.index as u32, x, part.volume, density, half);
                if let Some(corners) = points.corners.last_mut() {
                    *corners = part.corners;
                }
                if let Some(mark) = points.outermost.last_mut() {
                    *mark = f64::from(u8::from(outermost));
                }
            }
        }
    }

    fn split(&self, cell: usize, out: &mut Vec<SubCell<D>>) {
        match self.seeding {
            Seeding::PerCell(counts) => {
                self.mesh.sub_cells(cell, std::array::from_fn(|a| counts[a]), out);
            }
            Seeding::Gauss(order) => {
                let mut gauss = Vec::new();
                self.mesh.gauss_points(cell, *order, &mut gauss);
                out.extend(gauss.into_iter().map(|(position, volume)| {
                    let half = [0.5 * volume.powf(1.0 / D as f64); D];
                    let corners = rectangle_corners(position, half);
                    SubCell { position, centroid: position, volume, corners }
                }));
            }
            Seeding::Lattice { .. } => {}
        }
    }
}
