//! `mpm-par plot`: pictures of the points of a frame and of columns of a table.

mod common;

use std::path::Path;
use std::process::{Command, Output};

use common::run::Run;
use mpm_par::deck::templates::template_of;

fn plot(directory: &Path, words: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_mpm-par"));
    program.arg("plot").arg(directory).args(words);
    program.output().expect("the program")
}

#[track_caller]
fn good(directory: &Path, words: &[&str]) {
    let output = plot(directory, words);
    assert!(output.status.success(), "{words:?}: {}", String::from_utf8_lossy(&output.stderr));
}

/// Width, height, and the colours of the pixels.
fn pixels(path: &Path) -> (usize, usize, Vec<[u8; 3]>) {
    let file = std::io::BufReader::new(std::fs::File::open(path).expect("a picture"));
    let mut reader = png::Decoder::new(file).read_info().expect("a PNG");
    let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
    let info = reader.next_frame(&mut bytes).expect("pixels");
    let colours = bytes.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
    (info.width as usize, info.height as usize, colours)
}

#[test]
fn points_and_curves_are_drawn() {
    let run = Run::text(template_of("beam").unwrap().text).set("analysis.steps=4");
    let results = run.set("load.0.point.force=[0, -20e3]").results();
    let out = &results.directory;
    let file = |name: &str| out.join(name).display().to_string();
    good(out, &["--field", "displacement.y", "-o", &file("a.png")]);
    good(out, &["--field", "|displacement|", "--step", "2", "-o", &file("b.svg")]);
    good(out, &["--columns", "energy_strain,work_external", "-o", &file("c.svg")]);
    let probes = ["--table", "probes", "--columns", "tip.displacement.y", "--x", "step"];
    good(out, &[&probes[..], &["-o", &file("d.png")]].concat());
    good(out, &["--table", "residuals", "--columns", "residual", "--log", "-o", &file("e.svg")]);

    // A vector by its name is its length, and a domain is a polygon and its outline.
    good(out, &["--field", "displacement", "--step", "2", "-o", &file("f.svg")]);
    let text = |name: &str| std::fs::read_to_string(out.join(name)).expect("text");
    assert_eq!(text("f.svg"), text("b.svg"));
    good(out, &["--field", "displacement", "--domains", "-o", &file("g.svg")]);
    assert_eq!(text("g.svg").matches("<polygon").count(), 360);

    // The tip is lowest and has moved down most: the darkest colour; the root the brightest.
    let (width, height, colours) = pixels(&out.join("a.png"));
    let count = |colour: [u8; 3]| colours.iter().filter(|c| **c == colour).count();
    assert!(count([68, 1, 84]) > 50 && count([253, 231, 37]) > 50);
    let mean = |colour: [u8; 3]| {
        let at = (0..colours.len()).filter(|k| colours[*k] == colour && k % width < width - 190);
        let rows: Vec<f64> = at.map(|k| (k / width) as f64).collect();
        rows.iter().sum::<f64>() / rows.len() as f64
    };
    assert!(mean([68, 1, 84]) > mean([253, 231, 37]) + 0.1 * height as f64);

    // One square for each of the 360 points, beside those of the scale.
    let svg = std::fs::read_to_string(out.join("b.svg")).expect("text");
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
    assert!(svg.contains("out, step 2") && svg.contains("|displacement| [m]"), "{svg:.400}");
    let squares = svg.matches("<rect").count();
    assert!((360..900).contains(&squares), "{squares}");
    let curves = std::fs::read_to_string(out.join("c.svg")).expect("text");
    assert!(curves.contains("energy_strain [J/m]") && curves.contains("load_factor"));
    for colour in ["#1E6FB8", "#D1541F"] {
        assert_eq!(curves.matches(colour).count(), 2, "{colour}: a line, and again in the legend");
    }

    for (words, part) in [
        (&["--field", "stres.xx", "-o", "x.png"][..], "it has"),
        (&["--field", "stress.xx", "--step", "3", "-o", "x.png"], "there are those of 0, 2, 4"),
        (&["--field", "stress.xx", "-o", "x.pdf"], "ends in .png or .svg"),
        (&["--columns", "energy", "-o", "x.png"], "no column \"energy\""),
        (&["-o", "x.png"], "--field, points of a frame: |displacement|"),
        (&["-o", "x.png"], "--columns, curves of history.csv: step"),
    ] {
        let output = plot(out, words);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(text.contains(part), "{text}");
    }
    assert_eq!(plot(Path::new("nowhere"), &["--field", "J", "-o", "x.png"]).status.code(), Some(3));
}
