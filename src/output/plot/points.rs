//! Points as squares of their spacing, or their domains, coloured by a field; solids from the front and
//! above.

use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::*;

use super::{Drawing, LETTERS, tick, to_file};
use crate::error::Result;
use crate::output::series::frames::{Column, Frame, spacing};

const WIDTH: u32 = 1100;
/// Room for the scale of the colours and for axes, pixels.
const SCALE: u32 = 190;
const AXES: (u32, u32) = (100, 64);
const CAPTION: u32 = 44;

/// viridis (van der Walt and Smith, CC0) at 16 places.
const VIRIDIS: [[u8; 3]; 16] = [
    [68, 1, 84],
    [72, 26, 108],
    [71, 47, 125],
    [65, 68, 135],
    [57, 86, 140],
    [49, 104, 142],
    [42, 120, 142],
    [35, 136, 142],
    [31, 152, 139],
    [34, 168, 132],
    [53, 183, 121],
    [84, 197, 104],
    [122, 209, 81],
    [165, 219, 54],
    [210, 226, 27],
    [253, 231, 37],
];

fn colour(share: f64) -> RGBColor {
    if !share.is_finite() {
        return RGBColor(160, 160, 160);
    }
    let at = share.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
    let k = (at as usize).min(VIRIDIS.len() - 2);
    let mix = |i: usize| {
        let (a, b) = (f64::from(VIRIDIS[k][i]), f64::from(VIRIDIS[k + 1][i]));
        (a + (at - k as f64) * (b - a)).round() as u8
    };
    RGBColor(mix(0), mix(1), mix(2))
}

/// A frame with one of its columns.
pub struct Picture<'a> {
    pub frame: &'a Frame,
    pub column: &'a Column,
    pub values: &'a [f32],
    pub flat: bool,
    /// Least and largest colour; `None`: of the values.
    pub range: Option<(f64, f64)>,
    pub caption: String,
}

impl Picture<'_> {
    /// Draws to a .png or .svg file.
    pub fn write(&self, path: &Path) -> Result<()> {
        to_file(path, &Scene::of(self))
    }
}

/// Places on the paper, m, those behind first.
struct Scene<'a> {
    picture: &'a Picture<'a>,
    places: Vec<(f64, f64, f64)>,
    low: (f64, f64),
    high: (f64, f64),
    side: f64,
    colours: (f64, f64),
}

impl<'a> Scene<'a> {
    fn of(picture: &'a Picture<'a>) -> Self {
        let positions = &picture.frame.positions;
        let side = spacing(positions);
        let all: Vec<(f64, f64, f64)> =
            positions.chunks_exact(3).map(|x| projected(picture.flat, x)).collect();
        let drawn = picture.frame.corners.chunks_exact(3).map(|x| projected(picture.flat, x));
        let ends: Vec<(f64, f64, f64)> =
            if drawn.len() > 0 { drawn.collect() } else { all.clone() };
        let end = |pick: fn(&(f64, f64, f64)) -> f64, most: bool| {
            let values = ends.iter().map(pick);
            if most { values.fold(f64::MIN, f64::max) } else { values.fold(f64::MAX, f64::min) }
        };
        let half = if picture.frame.corners.is_empty() { 0.5 * side } else { 0.0 };
        let low = (end(|p| p.0, false) - half, end(|p| p.1, false) - half);
        let high = (end(|p| p.0, true) + half, end(|p| p.1, true) + half);
        let finite = picture.values.iter().map(|&v| f64::from(v)).filter(|v| v.is_finite());
        let own = finite.fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)));
        let own = if own.0 <= own.1 { own } else { (0.0, 0.0) };
        let colours = picture.range.unwrap_or(own);
        Scene { picture, places: all, low, high, side, colours }
    }

    /// Pixels per m, and the size of the drawn part.
    fn scale(&self) -> (f64, u32) {
        let across = (self.high.0 - self.low.0).max(f64::MIN_POSITIVE);
        let up = (self.high.1 - self.low.1).max(f64::MIN_POSITIVE);
        let width = f64::from(WIDTH - SCALE - AXES.0);
        let height = (width * up / across).clamp(120.0, 900.0);
        ((width / across).min(height / up), height.round() as u32)
    }
}

impl Drawing for Scene<'_> {
    fn size(&self) -> (u32, u32) {
        (WIDTH, self.scale().1 + AXES.1 + CAPTION)
    }

    fn draw<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
    ) -> std::result::Result<(), String> {
        let said = |error: DrawingAreaErrorKind<B::ErrorType>| error.to_string();
        area.fill(&WHITE).map_err(said)?;
        let (scale, height) = self.scale();
        let (body, legend) = area.split_horizontally(WIDTH - SCALE);
        // The drawn part keeps the proportions: what is left over goes to the range.
        let reach = (f64::from(WIDTH - SCALE - AXES.0) / scale, f64::from(height) / scale);
        let middle = (0.5 * (self.low.0 + self.high.0), 0.5 * (self.low.1 + self.high.1));
        let mut chart = ChartBuilder::on(&body)
            .caption(&self.picture.caption, ("sans-serif", LETTERS + 2))
            .x_label_area_size(AXES.1 - 20)
            .y_label_area_size(AXES.0 - 20)
            .margin_top(8)
            .margin_left(10)
            .margin_right(10)
            .margin_bottom(4)
            .build_cartesian_2d(
                middle.0 - 0.5 * reach.0..middle.0 + 0.5 * reach.0,
                middle.1 - 0.5 * reach.1..middle.1 + 0.5 * reach.1,
            )
            .map_err(said)?;
        if self.picture.flat {
            chart
                .configure_mesh()
                .disable_mesh()
                .x_desc("x [m]")
                .y_desc("y [m]")
                .x_label_formatter(&|x| tick(*x, reach.0))
                .y_label_formatter(&|y| tick(*y, reach.1))
                .label_style(("sans-serif", LETTERS - 4))
                .axis_desc_style(("sans-serif", LETTERS - 3))
                .draw()
                .map_err(said)?;
        }
        let mut order: Vec<usize> = (0..self.places.len()).collect();
        if !self.picture.flat {
            order.sort_by(|&a, &b| self.places[a].2.total_cmp(&self.places[b].2));
        }
        let half = 0.56 * self.side.max(1.5 / scale);
        let (low, high) = self.colours;
        let share = |value: f64| if high > low { (value - low) / (high - low) } else { 0.0 };
        let paint = |p: usize| colour(share(f64::from(self.picture.values[p])));
        if self.picture.frame.corners.is_empty() {
            let squares = order.iter().map(|&p| {
                let (x, y, _) = self.places[p];
                Rectangle::new([(x - half, y - half), (x + half, y + half)], paint(p).filled())
            });
            chart.draw_series(squares).map_err(said)?;
        } else {
            // An outline shows gaps and overlaps, where it does not cover the colour.
            let outline = BLACK.mix(if scale * self.side > 6.0 { 0.45 } else { 0.0 });
            for &p in &order {
                for face in self.faces(p) {
                    let edge = face.iter().chain(&face[..1]).copied().collect::<Vec<_>>();
                    chart.draw_series([Polygon::new(face, paint(p).filled())]).map_err(said)?;
                    chart
                        .draw_series([PathElement::new(edge, outline.stroke_width(1))])
                        .map_err(said)?;
                }
            }
        }
        let (x, y) = (chart.x_range(), chart.y_range());
        let (low, high) = ((x.start, y.start), (x.end, y.end));
        let edges = self.picture.frame.edges.iter().filter_map(|ends| {
            let place = |x: &[f32]| {
                let (x, y, _) = projected(self.picture.flat, x);
                (x, y)
            };
            clipped(place(&ends[..3]), place(&ends[3..]), low, high)
        });
        let style = BLACK.stroke_width(if self.picture.flat { 3 } else { 1 });
        let lines = edges.map(|(a, b)| PathElement::new(vec![a, b], style));
        chart.draw_series(lines).map_err(said)?;
        self.legend(&legend, height).map_err(said)?;
        area.present().map_err(said)
    }
}

/// Faces of a hexahedron, counter-clockwise as seen from outside.
const FACES: [[usize; 4]; 6] =
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];

impl Scene<'_> {
    /// The domain of a point: in the plane its corners, in space the faces that face the reader.
    fn faces(&self, p: usize) -> Vec<Vec<Place>> {
        let (frame, flat) = (self.picture.frame, self.picture.flat);
        let each = frame.corners.len() / frame.positions.len().max(1);
        let rows = frame.corners[3 * each * p..3 * each * (p + 1)].chunks_exact(3);
        let corners: Vec<Place> = rows
            .map(|x| {
                let (x, y, _) = projected(flat, x);
                (x, y)
            })
            .collect();
        if each != 8 {
            return vec![corners];
        }
        let face =
            |numbers: [usize; 4]| -> Vec<Place> { numbers.iter().map(|&k| corners[k]).collect() };
        FACES.map(face).into_iter().filter(|face| area(face) > 0.0).collect()
    }

    fn legend<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
        height: u32,
    ) -> std::result::Result<(), DrawingAreaErrorKind<B::ErrorType>> {
        let (low, high) = self.colours;
        let tall = (height as i32 - 10).min(420);
        let top = CAPTION as i32 + 24;
        let column = self.picture.column;
        let title = match column.unit.as_str() {
            "" | "-" => column.name.clone(),
            unit => format!("{} [{unit}]", column.name),
        };
        let style = |size: i32| ("sans-serif", size).into_font();
        area.draw(&Text::new(title, (4, CAPTION as i32 - 8), style(LETTERS - 3)))?;
        for k in 0..tall {
            let paint = colour(1.0 - f64::from(k) / f64::from(tall - 1)).filled();
            area.draw(&Rectangle::new([(4, top + k), (26, top + k + 1)], paint))?;
        }
        for k in 0..5 {
            let value = low + (high - low) * f64::from(4 - k) / 4.0;
            let y = top + tall * k / 4;
            area.draw(&PathElement::new(vec![(26, y), (32, y)], BLACK))?;
            area.draw(&Text::new(
                tick(rounded(value, high - low), high - low),
                (36, y - 8),
                style(LETTERS - 4),
            ))?;
        }
        Ok(())
    }
}

/// Across, up and towards the reader, m: in the plane x and y; of a solid what is seen from the front,
/// the right and above.
fn projected(flat: bool, x: &[f32]) -> (f64, f64, f64) {
    let [x, y, z] = [x[0], x[1], x[2]].map(f64::from);
    if flat {
        return (x, y, 0.0);
    }
    let (turn, tilt) = (-0.6_f64, 0.45_f64);
    let (ca, sa, cb, sb) = (turn.cos(), turn.sin(), tilt.cos(), tilt.sin());
    (ca * x + sa * y, -sa * sb * x + ca * sb * y + cb * z, sa * cb * x - ca * cb * y + sb * z)
}

type Place = (f64, f64);

/// Of a polygon; positive if its corners run counter-clockwise.
fn area(corners: &[Place]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    0.5 * corners.iter().zip(next).map(|(a, b)| a.0 * b.1 - b.0 * a.1).sum::<f64>()
}

/// The part of a line inside a rectangle (Liang and Barsky 1984).
fn clipped(a: Place, b: Place, low: Place, high: Place) -> Option<(Place, Place)> {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    let sides = [(-dx, a.0 - low.0), (dx, high.0 - a.0), (-dy, a.1 - low.1), (dy, high.1 - a.1)];
    for (step, room) in sides {
        if step == 0.0 && room < 0.0 {
            return None;
        }
        match step {
            _ if step < 0.0 => from = from.max(room / step),
            _ if step > 0.0 => to = to.min(room / step),
            _ => {}
        }
    }
    let at = |t: f64| (a.0 + t * dx, a.1 + t * dy);
    (from <= to).then(|| (at(from), at(to)))
}

/// To a ten-thousandth of the range: more digits say nothing on a scale.
fn rounded(value: f64, range: f64) -> f64 {
    if !(range > 0.0) {
        return value;
    }
    let unit = 10f64.powf((range * 1e-4).log10().floor());
    (value / unit).round() * unit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_at_the_rectangle() {
        let clip = |a, b| clipped(a, b, (0.0, 0.0), (2.0, 1.0));
        assert_eq!(clip((-1.0, 0.5), (3.0, 0.5)), Some(((0.0, 0.5), (2.0, 0.5))));
        assert_eq!(clip((0.5, 0.25), (1.5, 0.75)), Some(((0.5, 0.25), (1.5, 0.75))));
        assert_eq!(clip((1.0, -1.0), (1.0, 3.0)), Some(((1.0, 0.0), (1.0, 1.0))));
        assert_eq!(clip((3.0, 0.0), (3.0, 1.0)), None);
        assert_eq!(clip((-1.0, 0.5), (1.0, 3.0)), None);
    }
}
