//! A small line figure: panels side by side, both axes logarithmic, bands from least to most.

use std::fmt::Write as _;

pub struct Series {
    pub name: String,
    pub colour: String,
    /// x, and the values found there; `None` for a run that failed.
    pub points: Vec<(f64, Vec<Option<f64>>)>,
}

pub struct Panel {
    pub title: String,
    pub across: String,
    pub series: Vec<Series>,
}

const WIDTH: f64 = 330.0;
const HEIGHT: f64 = 250.0;
const LEFT: f64 = 55.0;
const TOP: f64 = 62.0;
const GAP: f64 = 60.0;
const LOW: f64 = 5.0;
const HIGH: f64 = 1000.0;

/// The figure as SVG text.
pub fn figure(title: &str, panels: &[Panel]) -> String {
    let width = LEFT + panels.len() as f64 * (WIDTH + GAP);
    let height = TOP + HEIGHT + 75.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n\
         <text x=\"{LEFT}\" y=\"24\" font-size=\"15\">{title}</text>\n"
    );
    for (i, panel) in panels.iter().enumerate() {
        draw(&mut svg, panel, LEFT + i as f64 * (WIDTH + GAP));
    }
    let mut x = LEFT;
    for series in panels.first().map_or(&[][..], |panel| &panel.series) {
        let y = TOP + HEIGHT + 58.0;
        let _ = writeln!(
            svg,
            "<line x1=\"{x}\" y1=\"{y}\" x2=\"{}\" y2=\"{y}\" stroke=\"{}\" stroke-width=\"3\"/>\
             <text x=\"{}\" y=\"{}\">{}</text>",
            x + 22.0,
            series.colour,
            x + 28.0,
            y + 4.0,
            series.name
        );
        x += 60.0 + 7.0 * series.name.len() as f64;
    }
    let _ = writeln!(
        svg,
        "<text x=\"{x}\" y=\"{}\">x  no convergence</text>\n</svg>",
        TOP + HEIGHT + 62.0
    );
    svg
}

fn draw(svg: &mut String, panel: &Panel, left: f64) {
    let all = || panel.series.iter().flat_map(|s| s.points.iter().map(|p| p.0));
    let (first, last) = all().fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
    let across = |x: f64| left + 15.0 + (WIDTH - 30.0) * (x / first).ln() / (last / first).ln();
    let up = |y: f64| TOP + HEIGHT * (1.0 - (y.clamp(LOW, HIGH) / LOW).ln() / (HIGH / LOW).ln());
    let _ = writeln!(
        svg,
        "<rect x=\"{left}\" y=\"{TOP}\" width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"none\" \
         stroke=\"#333\"/>\n<text x=\"{left}\" y=\"{}\">{}</text>\n\
         <text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
        TOP - 8.0,
        panel.title,
        left + 0.5 * WIDTH,
        TOP + HEIGHT + 34.0,
        panel.across
    );
    for y in [10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0] {
        let _ = writeln!(
            svg,
            "<line x1=\"{left}\" x2=\"{}\" y1=\"{1}\" y2=\"{1}\" stroke=\"#ddd\"/>\
             <text x=\"{2}\" y=\"{3}\" text-anchor=\"end\">{y}</text>",
            left + WIDTH,
            up(y),
            left - 5.0,
            up(y) + 4.0
        );
    }
    if let Some(series) = panel.series.first() {
        for (x, _) in &series.points {
            let _ = writeln!(
                svg,
                "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{x}</text>",
                across(*x),
                TOP + HEIGHT + 17.0
            );
        }
    }
    for (order, series) in panel.series.iter().enumerate() {
        let colour = &series.colour;
        let (mut middle, mut lower, mut upper) = (String::new(), String::new(), Vec::new());
        for (x, values) in &series.points {
            let mut found: Vec<f64> = values.iter().copied().flatten().collect();
            found.sort_by(f64::total_cmp);
            let failed = values.len() - found.len();
            if failed > 0 {
                // One mark per failed run, set apart for each series.
                for k in 0..failed {
                    let _ = writeln!(
                        svg,
                        "<text x=\"{}\" y=\"{}\" fill=\"{colour}\" text-anchor=\"middle\">x</text>",
                        across(*x) + 7.0 * (k as f64 - 0.5 * (failed as f64 - 1.0)),
                        TOP + 12.0 + 10.0 * order as f64
                    );
                }
            }
            let (Some(least), Some(most)) = (found.first(), found.last()) else { continue };
            let _ = write!(middle, "{:.1},{:.1} ", across(*x), up(found[found.len() / 2]));
            let _ = write!(lower, "{:.1},{:.1} ", across(*x), up(*least));
            upper.push(format!("{:.1},{:.1} ", across(*x), up(*most)));
        }
        upper.reverse();
        let _ = writeln!(
            svg,
            "<polygon points=\"{lower}{}\" fill=\"{colour}\" fill-opacity=\"0.18\"/>\n\
             <polyline points=\"{middle}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2.5\"/>",
            upper.concat()
        );
    }
}
