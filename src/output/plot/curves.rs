//! Columns of a table as lines.

use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::*;

use super::{Drawing, LETTERS, tick, to_file};
use crate::error::{Error, Result};
use crate::output::tables::csv_table::whole_rows;

const COLOURS: [RGBColor; 8] = [
    RGBColor(30, 111, 184),
    RGBColor(209, 84, 31),
    RGBColor(42, 148, 84),
    RGBColor(154, 79, 181),
    RGBColor(184, 134, 11),
    RGBColor(194, 48, 107),
    RGBColor(59, 143, 158),
    RGBColor(107, 107, 107),
];

/// Lines over one column.
pub struct Curves {
    pub caption: String,
    /// Title, with the unit, and values.
    pub x: (String, Vec<f64>),
    pub lines: Vec<(String, Vec<f64>)>,
    /// The vertical axis is logarithmic: what is not positive is left out.
    pub logarithmic: bool,
}

impl Curves {
    /// Columns of a csv table whose header is `name [unit]`, by their names. `x`: `None` for the
    /// time, the load factor or the step: the first that grows from row to row (the load factor begins
    /// anew in each stage).
    ///
    /// # Errors
    /// `Input` for a column that is not there.
    pub fn of_table(
        text: &str,
        names: &[String],
        x: Option<&str>,
        logarithmic: bool,
        caption: Option<String>,
    ) -> Result<Self> {
        let text = whole_rows(text);
        let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(text.as_bytes());
        let unreadable = |reason: csv::Error| Error::File(format!("not a table: {reason}"));
        let header: Vec<String> =
            reader.headers().map_err(unreadable)?.iter().map(String::from).collect();
        let rows = reader.records().filter_map(|row| row.ok());
        let rows: Vec<csv::StringRecord> = rows.filter(|row| row.len() == header.len()).collect();
        let column = |name: &str| -> Result<(String, Vec<f64>)> {
            let at = header
                .iter()
                .position(|title| title == name || title.split(" [").next() == Some(name));
            let Some(at) = at else {
                let known: Vec<&str> =
                    header.iter().filter_map(|title| title.split(" [").next()).collect();
                let known = known.join(", ");
                let why = format!("the table has no column \"{name}\"; it has {known}");
                return Err(Error::Input(why));
            };
            let value = |row: &csv::StringRecord| row[at].parse().unwrap_or(f64::NAN);
            let title = header[at].trim_end_matches(" [-]").to_string();
            Ok((title, rows.iter().map(value).collect()))
        };
        let x = match x {
            Some(name) => column(name)?,
            None => {
                let usual = ["time", "load_factor", "step"];
                let mut known = usual.iter().filter_map(|name| column(name).ok());
                known.find(|(_, values)| grows(values)).map_or_else(|| column("step"), Ok)?
            }
        };
        let lines = names.iter().map(|name| column(name)).collect::<Result<Vec<_>>>()?;
        Ok(Curves { caption: caption.unwrap_or_default(), x, lines, logarithmic })
    }

    /// Draws to a .png or .svg file.
    pub fn write(&self, path: &Path) -> Result<()> {
        to_file(path, self)
    }

    /// Places of a line; with a logarithmic axis powers of ten.
    fn coordinates(&self, values: &[f64]) -> Vec<(f64, f64)> {
        let scaled = |y: f64| if self.logarithmic { y.log10() } else { y };
        let pairs = self.x.1.iter().zip(values).map(|(&x, &y)| (x, scaled(y)));
        pairs.filter(|(x, y)| x.is_finite() && y.is_finite()).collect()
    }
}

/// Never falls, and is not zero throughout.
fn grows(values: &[f64]) -> bool {
    values.iter().any(|v| *v != 0.0) && values.windows(2).all(|pair| pair[0] <= pair[1])
}

/// The corner for the legend: the one with the fewest places of lines in its third of the picture.
fn free_corner<'a>(
    places: impl Iterator<Item = &'a (f64, f64)>,
    x: (f64, f64),
    y: (f64, f64),
) -> SeriesLabelPosition {
    // Upper left, upper right, lower right, lower left.
    let mut counts = [0; 4];
    for place in places {
        let across = (place.0 - x.0) / (x.1 - x.0);
        let up = (place.1 - y.0) / (y.1 - y.0);
        let (left, right) = (across < 0.33, across > 0.67);
        let (low, high) = (up < 0.33, up > 0.67);
        for (count, is_in) in
            counts.iter_mut().zip([left && high, right && high, right && low, left && low])
        {
            *count += usize::from(is_in);
        }
    }
    let least = (0..4).min_by_key(|&corner| counts[corner]).unwrap_or(0);
    match least {
        0 => SeriesLabelPosition::UpperLeft,
        1 => SeriesLabelPosition::UpperRight,
        2 => SeriesLabelPosition::LowerRight,
        _ => SeriesLabelPosition::LowerLeft,
    }
}

/// Ends with a little margin; a width where all are equal.
fn ends(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values.fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)));
    if low > high {
        return (0.0, 1.0);
    }
    let margin = if high > low { 0.03 * (high - low) } else { low.abs().max(1.0) * 0.1 };
    (low - margin, high + margin)
}

impl Drawing for Curves {
    fn size(&self) -> (u32, u32) {
        (1000, 620)
    }

    fn draw<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
    ) -> std::result::Result<(), String> {
        let said = |error: DrawingAreaErrorKind<B::ErrorType>| error.to_string();
        area.fill(&WHITE).map_err(said)?;
        let all: Vec<Vec<(f64, f64)>> =
            self.lines.iter().map(|(_, values)| self.coordinates(values)).collect();
        let coordinates = || all.iter().flatten();
        let (x, y) = (ends(coordinates().map(|p| p.0)), ends(coordinates().map(|p| p.1)));
        let mut chart = ChartBuilder::on(area)
            .caption(&self.caption, ("sans-serif", LETTERS + 2))
            .x_label_area_size(56)
            .y_label_area_size(96)
            .margin(14)
            .build_cartesian_2d(x.0..x.1, y.0..y.1)
            .map_err(said)?;
        let corner = free_corner(coordinates(), x, y);
        let title = match &self.lines[..] {
            [(one, _)] => one.clone(),
            _ => String::new(),
        };
        let logarithmic = self.logarithmic;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(BLACK.mix(0.15))
            .x_desc(&self.x.0)
            .y_desc(title)
            .x_label_formatter(&|value| tick(*value, x.1 - x.0))
            .y_label_formatter(&|value| match logarithmic {
                true => tick(10f64.powf(*value), 0.0),
                false => tick(*value, y.1 - y.0),
            })
            .label_style(("sans-serif", LETTERS - 4))
            .axis_desc_style(("sans-serif", LETTERS - 2))
            .draw()
            .map_err(said)?;
        for (k, ((name, _), coordinates)) in self.lines.iter().zip(all).enumerate() {
            let style = COLOURS[k % COLOURS.len()].stroke_width(2);
            let series = chart.draw_series(LineSeries::new(coordinates, style)).map_err(said)?;
            if self.lines.len() > 1 {
                series
                    .label(name)
                    .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 24, y)], style));
            }
        }
        if self.lines.len() > 1 {
            chart
                .configure_series_labels()
                .position(corner)
                .background_style(WHITE.mix(0.85))
                .border_style(BLACK.mix(0.2))
                .label_font(("sans-serif", LETTERS - 4))
                .draw()
                .map_err(said)?;
        }
        area.present().map_err(said)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_legend_stands_where_no_line_is() {
        let ends = (0.0, 1.0);
        let of = |places: &[(f64, f64)]| free_corner(places.iter(), ends, ends);
        assert!(matches!(of(&[]), SeriesLabelPosition::UpperLeft));
        let left = [(0.1, 0.9), (0.1, 0.1)];
        assert!(matches!(of(&left), SeriesLabelPosition::UpperRight));
        let top = [(0.1, 0.9), (0.9, 0.9)];
        assert!(matches!(of(&top), SeriesLabelPosition::LowerRight));
        let all_but_one = [(0.1, 0.9), (0.9, 0.9), (0.9, 0.1)];
        assert!(matches!(of(&all_but_one), SeriesLabelPosition::LowerLeft));
    }

    #[test]
    fn what_grows_is_drawn_across() {
        let across = |text: &str| {
            let curves = Curves::of_table(text, &["y".into()], None, false, None).unwrap();
            curves.x.0
        };
        assert_eq!(
            across("step [-],load_factor [-],time [s],y [m]\n1,0.5,0,3\n2,1,0,4\n"),
            "load_factor"
        );
        assert_eq!(across("step [-],load_factor [-],time [s],y [m]\n1,1,0,3\n2,0.5,0,4\n"), "step");
        assert_eq!(
            across("step [-],load_factor [-],time [s],y [m]\n1,1,2,3\n2,1,3,4\n"),
            "time [s]"
        );
    }
}
