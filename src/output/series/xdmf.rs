//! XDMF time series: small XML files by which ParaView finds the data in the HDF5 files.
//!
//! Rules that readers crash on when broken: geometry has three columns always; point clouds
//! state `NodesPerElement`; steps sit in a temporal collection; HDF5 files are named without a
//! folder; every stated dimension is the stored one.

use std::fmt::Write as _;

use quick_xml::escape::escape;

use super::frame::{Array, Frame, Number, Totals};
use super::frame_series::StepTime;

const GRID_START: &str = "      <Grid Name=\"step ";
const GRID_END: &str = "      </Grid>\n";
/// Closes what [`SERIES_HEAD`](crate::output::names::SERIES_HEAD) opens.
pub const TAIL: &str = "    </Grid>\n  </Domain>\n</Xdmf>\n";

/// The text of a frame whose data lie in the HDF5 file `data`, named without folder.
pub fn entry(
    (step, time): StepTime,
    frame: &Frame<'_>,
    (points, cells): Totals,
    data: &str,
) -> String {
    let each = frame.topology.points_per_cell();
    let mut xml = String::new();
    let _ = write!(
        xml,
        "{GRID_START}{step}\" GridType=\"Uniform\">\n        <Time Value=\"{time:e}\"/>\n        \
         <Topology TopologyType=\"{}\" NumberOfElements=\"{cells}\" NodesPerElement=\"{each}\">\n{}        \
         </Topology>\n        <Geometry GeometryType=\"XYZ\">\n{}        </Geometry>\n",
        frame.topology.xdmf_name(),
        item("Int", (cells, each), data, frame.nodes),
        item("Float", (points, 3), data, frame.places.name),
    );
    let mut attributes = |arrays: &[Array<'_>], center: &str, rows: usize| {
        for array in arrays {
            let kind = match array.columns {
                1 => "Scalar",
                3 => "Vector",
                6 => "Tensor6",
                9 => "Tensor",
                _ => "Matrix",
            };
            let number = if array.number == Number::Float { "Float" } else { "Int" };
            let _ = write!(
                xml,
                "        <Attribute Name=\"{}\" AttributeType=\"{kind}\" Center=\"{center}\">\n{}        \
                 </Attribute>\n",
                escape(array.name),
                item(number, (rows, array.columns), data, array.name),
            );
        }
    };
    attributes(&frame.point_data, "Node", points);
    attributes(&frame.cell_data, "Cell", cells);
    xml.push_str(GRID_END);
    xml
}

fn item(number: &str, (rows, columns): (usize, usize), file: &str, dataset: &str) -> String {
    let dimensions = match columns {
        1 => rows.to_string(),
        columns => format!("{rows} {columns}"),
    };
    format!(
        "          <DataItem Dimensions=\"{dimensions}\" NumberType=\"{number}\" Precision=\"8\" \
         Format=\"HDF\">{}:/{}</DataItem>\n",
        escape(file),
        escape(dataset),
    )
}

/// Step and text of each frame of a series; `None` if the text is no such series.
pub fn split(text: &str) -> Option<Vec<(usize, String)>> {
    let mut pieces = Vec::new();
    let mut rest = text;
    while let Some(start) = rest.find(GRID_START) {
        let end = start + rest[start..].find(GRID_END)? + GRID_END.len();
        let step = rest[start + GRID_START.len()..].split('"').next()?.parse().ok()?;
        pieces.push((step, rest[start..end].to_owned()));
        rest = &rest[end..];
    }
    text.contains("CollectionType=\"Temporal\"").then_some(pieces)
}

#[cfg(test)]
mod tests {
    use super::super::frame::Topology;
    use super::*;
    use crate::output::names::SERIES_HEAD;

    fn text(step: usize) -> String {
        let stress = Array { columns: 6, ..Array::floats("a<b", Vec::new) };
        let frame = Frame {
            topology: Topology::Polyvertex,
            points: 0,
            cells: 0,
            places: Array::vectors::<3>("position", &[]),
            nodes: "vertices",
            connectivity: None,
            point_data: vec![stress],
            cell_data: Vec::new(),
        };
        entry((step, 0.1 * step as f64), &frame, (7, 7), &format!("points-{step:06}.h5"))
    }

    #[test]
    fn a_series_is_split_into_the_pieces_it_was_made_of() {
        let pieces: Vec<_> = [0, 5, 10].map(|step| (step, text(step))).to_vec();
        let series = |pieces: &[(usize, String)]| {
            let texts: String = pieces.iter().map(|(_, text)| text.as_str()).collect();
            format!("{SERIES_HEAD}{texts}{TAIL}")
        };
        assert_eq!(split(&series(&pieces)), Some(pieces));
        assert_eq!(split("<Xdmf/>"), None);
        assert_eq!(split(&series(&[])), Some(vec![]));
    }

    #[test]
    fn the_text_follows_the_rules() {
        let xml = text(5);
        for part in [
            "<Topology TopologyType=\"Polyvertex\" NumberOfElements=\"7\" NodesPerElement=\"1\">",
            "<Attribute Name=\"a&lt;b\" AttributeType=\"Tensor6\" Center=\"Node\">",
            "Dimensions=\"7 6\" NumberType=\"Float\" Precision=\"8\" Format=\"HDF\">\
             points-000005.h5:/a&lt;b</DataItem>",
            "<Time Value=\"5e-1\"/>",
        ] {
            assert!(xml.contains(part), "{part} is missing from\n{xml}");
        }
    }
}
