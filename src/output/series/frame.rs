//! What a frame of a series shows, whatever the format of its file: cells over points in space, and tables of
//! numbers at the points and at the cells.

use super::hdf5_writer::FileWriter;
use super::point_field::append_vector;
use crate::error::Result;

/// Shape of all cells of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Topology {
    Polyvertex,
    Segment,
    Triangle,
    Quadrilateral,
    Tetrahedron,
    Hexahedron,
}

impl Topology {
    /// XDMF's name, VTK's number, and the points of a cell.
    fn facts(self) -> (&'static str, u8, usize) {
        match self {
            Topology::Polyvertex => ("Polyvertex", 1, 1),
            Topology::Segment => ("Polyline", 3, 2),
            Topology::Triangle => ("Triangle", 5, 3),
            Topology::Quadrilateral => ("Quadrilateral", 9, 4),
            Topology::Tetrahedron => ("Tetrahedron", 10, 4),
            Topology::Hexahedron => ("Hexahedron", 12, 8),
        }
    }

    pub fn xdmf_name(self) -> &'static str {
        self.facts().0
    }

    pub fn vtk_number(self) -> u8 {
        self.facts().1
    }

    pub fn points_per_cell(self) -> usize {
        self.facts().2
    }
}

/// Rows of a table, one after the other.
#[derive(Debug)]
pub enum Values {
    Floats(Vec<f64>),
    Integers(Vec<i64>),
    Bytes(Vec<u8>),
}

impl Values {
    /// As they lie in memory.
    pub fn bytes(&self) -> &[u8] {
        match self {
            Values::Floats(values) => bytemuck::cast_slice(values),
            Values::Integers(values) => bytemuck::cast_slice(values),
            Values::Bytes(values) => values,
        }
    }
}

/// Type of the numbers of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Number {
    Float,
    Integer,
    Byte,
}

/// A table of numbers; this rank's rows are made when they are written.
pub struct Array<'a> {
    pub name: &'a str,
    pub unit: &'a str,
    pub meaning: &'a str,
    pub columns: usize,
    /// Names of the columns.
    pub components: &'static [&'static str],
    pub number: Number,
    pub values: Box<dyn Fn() -> Values + 'a>,
}

impl<'a> Array<'a> {
    /// A table of one column.
    pub fn new(name: &'a str, number: Number, values: impl Fn() -> Values + 'a) -> Self {
        let values = Box::new(values);
        Array { name, unit: "", meaning: "", columns: 1, components: &[], number, values }
    }

    pub fn floats(name: &'a str, values: impl Fn() -> Vec<f64> + 'a) -> Self {
        Array::new(name, Number::Float, move || Values::Floats(values()))
    }

    pub fn integers(name: &'a str, values: impl Fn() -> Vec<i64> + 'a) -> Self {
        Array::new(name, Number::Integer, move || Values::Integers(values()))
    }

    /// Rows of three columns, whatever the dimension.
    pub fn vectors<const D: usize>(name: &'a str, vectors: &'a [[f64; D]]) -> Self {
        let rows = || {
            let mut rows = Vec::with_capacity(3 * vectors.len());
            vectors.iter().for_each(|vector| append_vector(vector, &mut rows));
            rows
        };
        Array { columns: 3, components: &["x", "y", "z"], ..Array::floats(name, rows) }
    }

    pub fn described(self, unit: &'a str, meaning: &'a str) -> Self {
        Array { unit, meaning, ..self }
    }

    /// Writes a dataset of `rows` rows on this rank; returns the number of rows of all ranks.
    fn store(&self, file: &FileWriter, rows: usize) -> Result<usize> {
        let values = (self.values)();
        let length = values.bytes().len() / if self.number == Number::Byte { 1 } else { 8 };
        assert_eq!(length, rows * self.columns, "numbers of {}", self.name);
        let total = match values {
            Values::Floats(values) => file.write_rows(self.name, self.columns, &values),
            Values::Integers(values) => file.write_rows(self.name, self.columns, &values),
            Values::Bytes(values) => file.write_rows(self.name, self.columns, &values),
        }?;
        file.describe(self.name, self.unit, self.meaning)?;
        Ok(total)
    }
}

/// This rank's share of a frame.
pub struct Frame<'a> {
    pub topology: Topology,
    pub points: usize,
    pub cells: usize,
    /// x, y, z of each point, m.
    pub places: Array<'a>,
    /// Name of the dataset of the cells' points.
    pub nodes: &'a str,
    /// Points of each cell, numbered over all ranks; `None`: each cell has its own, in order.
    pub connectivity: Option<&'a [usize]>,
    pub point_data: Vec<Array<'a>>,
    pub cell_data: Vec<Array<'a>>,
}

/// Points and cells of all ranks.
pub type Totals = (usize, usize);

impl Frame<'_> {
    /// The points of this rank's cells, of which `first` is the first.
    pub fn numbers(&self, first: usize) -> Vec<i64> {
        let each = self.topology.points_per_cell();
        match self.connectivity {
            Some(given) => given.iter().map(|&node| node as i64).collect(),
            None => (first * each..(first + self.cells) * each).map(|node| node as i64).collect(),
        }
    }

    /// Tables at points, but for one that repeats the places.
    pub fn own_point_data(&self) -> impl Iterator<Item = &Array<'_>> {
        self.point_data.iter().filter(|array| array.name != self.places.name)
    }

    /// Writes places, cells and tables into an HDF5 file. Collective.
    pub fn store(&self, file: &FileWriter) -> Result<Totals> {
        let totals = self.store_shape(file)?;
        for array in self.own_point_data() {
            array.store(file, self.points)?;
        }
        for array in &self.cell_data {
            array.store(file, self.cells)?;
        }
        Ok(totals)
    }

    /// Writes places and cells into an HDF5 file. Readers disagree about point clouds and polygons without
    /// connectivity, so it is spelled out. Collective.
    pub fn store_shape(&self, file: &FileWriter) -> Result<Totals> {
        let points = self.places.store(file, self.points)?;
        let numbers = self.numbers(file.first_row(self.cells));
        let cells = file.write_rows(self.nodes, self.topology.points_per_cell(), &numbers)?;
        Ok((points, cells))
    }
}
