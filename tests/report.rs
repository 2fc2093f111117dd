//! `report.html`: what it holds is what the run has written; a browser shows it, and its controls
//! change the picture.

mod common;

use std::path::{Path, PathBuf};
use std::process::Command;

use common::run::Run;
use mpm_par::deck::templates::template_of;
use serde_json::Value;

const CUBE: &str = include_str!("decks/cube.toml");

fn beam() -> Run {
    let text = template_of("beam").expect("a template").text;
    let run = Run::text(text).set("analysis.steps=4").set("output.every=1");
    run.set("load.0.point.force=[0, -20e3]")
}

/// The data inside a page.
fn data(page: &str) -> Value {
    let start = page.split("id=\"data\">").nth(1).expect("data");
    serde_json::from_str(start.split("</script>").next().expect("an end")).expect("JSON")
}

fn decoded(text: &str) -> Vec<u16> {
    let letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let (mut bits, mut word, mut bytes) = (0, 0u32, Vec::new());
    for letter in text.trim_end_matches('=').chars() {
        word = (word << 6) | letters.find(letter).expect("a letter") as u32;
        bits += 6;
        if bits >= 8 {
            bits -= 8;
            bytes.push((word >> bits) as u8);
            word &= (1 << bits) - 1;
        }
    }
    bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect()
}

#[test]
fn the_page_holds_what_the_run_has_written() {
    let results = beam().ranks(2).results();
    let page = results.text("report.html");
    assert!(page.starts_with("<!doctype html>\n") && page.trim_end().ends_with("</html>"));
    // Nothing is fetched; the licences of uPlot and OGL travel with it.
    assert!(page.contains("The MIT License (MIT)") && page.contains("Leon Sorokin"));
    assert!(page.contains("https://unlicense.org"));
    for outside in ["<script src", "<link", "@import", "fetch(", "url("] {
        assert!(!page.contains(outside), "{outside}");
    }
    let data = data(&page);
    assert_eq!(data["title"], "Elastic cantilever");
    assert_eq!(data["summary"], results.summary);
    assert_eq!(data["grid"]["h"], serde_json::json!([0.5, 0.5]));
    let history = &data["tables"]["history"];
    assert_eq!(history["rows"], 4);
    let header: Vec<&str> =
        history["header"].as_array().unwrap().iter().map(|word| word.as_str().unwrap()).collect();
    let energy = header.iter().position(|name| *name == "energy_strain [J/m]").expect("a column");
    let shown = history["columns"][energy][3].as_f64().unwrap();
    let written = results.history("energy_strain")[3];
    assert!((shown - written).abs() < 1e-6 * written, "{shown} {written}");
    assert_eq!(data["tables"]["probes"]["header"][3], "tip.displacement.x [m]");

    let points = &data["points"];
    assert_eq!(points["frames"].as_array().unwrap().len(), 5);
    let names: Vec<&str> =
        points["columns"].as_array().unwrap().iter().map(|c| c["name"].as_str().unwrap()).collect();
    assert_eq!(
        names,
        [
            "|displacement|",
            "von_mises",
            "body",
            "rank",
            "displacement.x",
            "displacement.y",
            "stress.xx",
            "stress.xy",
            "stress.yy",
            "stress.zz"
        ]
    );
    let at = names.iter().position(|name| *name == "von_mises").expect("a field");
    assert_eq!(points["columns"][at]["unit"], "Pa");
    // All values of the last frame, whatever their order, to a step of the packing.
    let range: Vec<f64> = points["columns"][at]["range"]
        .as_array()
        .unwrap()
        .iter()
        .map(|x| x.as_f64().unwrap())
        .collect();
    let packed = decoded(points["frames"][4]["values"][at].as_str().unwrap());
    let step = (range[1] - range[0]) / 65534.0;
    let mut shown: Vec<f64> = packed.iter().map(|k| range[0] + step * f64::from(*k)).collect();
    let mut written = results.points(4).component("von_mises", 0);
    [&mut shown, &mut written].iter_mut().for_each(|values| values.sort_by(f64::total_cmp));
    assert_eq!(shown.len(), written.len());
    for (shown, written) in shown.iter().zip(&written) {
        assert!((shown - written).abs() <= step, "{shown} {written}");
    }
}

#[test]
fn it_is_made_on_demand_and_of_what_there_is() {
    let results = beam().set("output.report=false").results();
    assert!(!results.directory.join("report.html").exists());
    let report = |words: &[&str]| {
        let mut program = Command::new(env!("CARGO_BIN_EXE_mpm-par"));
        program.arg("report").args(words).output().expect("the program")
    };
    let directory = results.directory.display().to_string();
    // As in a run that goes on: the summary is not there yet, and a row is cut short.
    std::fs::remove_file(results.directory.join("summary.json")).unwrap();
    let history = results.text("history.csv");
    std::fs::write(results.directory.join("history.csv"), &history[..history.len() - 9]).unwrap();
    let output = report(&[&directory]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let data = data(&results.text("report.html"));
    assert_eq!(data["summary"], Value::Null);
    assert_eq!(data["tables"]["history"]["rows"], 3);
    // --force knows it as a file of a run.
    let folder = results.into_folder();
    let again = beam().word("--force").set("output.report=false").attempt_in(folder);
    assert_eq!(again.code, 0, "{}", again.stderr);
    assert!(!again.folder.path().join("out/report.html").exists());

    let empty = tempfile::tempdir().unwrap();
    for (place, words) in [("nowhere", "cannot read"), ("", "holds no results")] {
        let output = report(&[&empty.path().join(place).display().to_string()]);
        assert_eq!(output.status.code(), Some(3));
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(text.contains(words), "{text}");
    }
}

#[test]
fn every_kind_of_run_has_one() {
    let element = Run::text(template_of("triaxial").unwrap().text).results();
    let page = data(&element.text("report.html"));
    assert_eq!(page["tables"]["element"]["rows"], 101);
    assert_eq!(page["points"], Value::Null);
    // A run that fails tells of itself, too.
    let failed = beam().set("analysis.max_iterations=2").attempt();
    assert_eq!(failed.code, 1, "{}", failed.stderr);
    let page = std::fs::read_to_string(failed.folder.path().join("out/report.html")).unwrap();
    assert_ne!(data(&page)["summary"]["status"], "completed");
    // That it cannot be written is no fault of the run.
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(folder.path().join("out/report.html.partial")).unwrap();
    let run = beam().attempt_in(folder);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(run.stdout.contains("warning: no report: cannot write"), "{}", run.stdout);
}

/// A million points, as `output` writes them: the page holds a sample, says so, and stays below 20 MB; a
/// picture is drawn of all. Times are in docs/guide/results.md.
#[test]
fn a_million_points_fit_in_a_page() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    std::fs::create_dir(&out).unwrap();
    std::fs::write(out.join("log.txt"), "").unwrap();
    let count = 100 * 100 * 100;
    let place = |id: usize| [id / 10_000, id / 100 % 100, id % 100].map(|k| k as f64 * 0.01);
    let positions: Vec<f64> = (0..count).flat_map(place).collect();
    let ids: Vec<u64> = (0..count as u64).collect();
    for step in 0..3u64 {
        let written = folder.path().join("frame.h5");
        let file = hdf5::File::create(&written).unwrap();
        let attribute = file.new_attr::<u64>().create("step").unwrap();
        attribute.write_scalar(&step).unwrap();
        file.new_attr::<f64>().create("time").unwrap().write_scalar(&(step as f64)).unwrap();
        let write = |name: &str, values: &[f64]| {
            let columns = values.len() / count;
            let space = file.new_dataset::<f64>().shape((count, columns)).create(name).unwrap();
            space.write_raw(values).unwrap();
        };
        write("position", &positions);
        // The stress says which point it is of.
        let stress: Vec<f64> = (0..6 * count).map(|k| (k / 6) as f64 + step as f64).collect();
        write("stress", &stress);
        file.new_dataset::<u64>().shape(count).create("id").unwrap().write_raw(&ids).unwrap();
        drop((attribute, file));
        // A process that another test begins meanwhile may inherit HDF5's lock: a copy has none.
        std::fs::copy(&written, out.join(format!("points-{step:06}.h5"))).unwrap();
        std::fs::remove_file(&written).unwrap();
    }
    let program = |words: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_mpm-par")).args(words).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    let directory = out.display().to_string();
    program(&["report", &directory]);
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.len() <= 20_000_000, "{} bytes", page.len());
    let points = &data(&page)["points"];
    assert_eq!((&points["all"], points["frames"].as_array().unwrap().len()), (&count.into(), 3));
    let stride = points["stride"].as_u64().unwrap();
    assert!(stride > 1, "{stride}");
    let names = points["columns"].as_array().unwrap();
    let at = names.iter().position(|column| column["name"] == "stress.yy").expect("a field");
    let range = [0, 1].map(|k: usize| names[at]["range"][k].as_f64().unwrap());
    let scale = (range[1] - range[0]) / 65534.0;
    let shown = decoded(points["frames"][2]["values"][at].as_str().unwrap());
    assert!(shown.len() >= 50_000, "{}", shown.len());
    for (k, value) in shown.iter().enumerate() {
        let id = k as f64 * stride as f64;
        assert!((range[0] + scale * f64::from(*value) - id - 2.0).abs() <= scale, "{k}: {value}");
    }
    let picture = out.join("a.png").display().to_string();
    program(&["plot", &directory, "--field", "stress.yy", "-o", &picture]);
    assert!(std::fs::read(&picture).unwrap().starts_with(b"\x89PNG"));
}

/// A browser on this machine.
fn browser() -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let places =
        std::env::split_paths(&path).flat_map(|folder| names.map(|name| folder.join(name)));
    places.into_iter().find(|place| place.is_file())
}

/// The page after `script`, which ends by a text in the element `said`.
fn browsed(browser: &Path, page: &str, script: &str, flag: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("page.html");
    let added = format!(
        "<pre id=\"said\"></pre><script>\
         const said = (text) => {{ document.getElementById('said').textContent = text; }};\
         addEventListener('error', (e) => said('fault: ' + e.message));\
         try {{ {script} }} catch (e) {{ said('fault: ' + e.stack); }}</script></body>"
    );
    std::fs::write(&path, page.replace("</body>", &added)).unwrap();
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", flag])
        .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
        .args(["--window-size=1000,900", "--virtual-time-budget=4000", "--dump-dom"])
        .arg(format!("file://{}", path.display()))
        .output()
        .expect("the browser starts");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let said = text.split("<pre id=\"said\">").nth(1).and_then(|t| t.split("</pre>").next());
    said.unwrap_or_else(|| panic!("{}", String::from_utf8_lossy(&output.stderr))).to_string()
}

/// Moves the slider, changes the field, turns the body, and reads pixels, without a mouse; where a browser has
/// WebGL and where it has none.
#[test]
fn a_browser_shows_the_points_and_its_controls_change_them() {
    let Some(browser) = browser() else {
        println!("not run: no chromium on the PATH");
        return;
    };
    let script = "
        const canvas = document.getElementById('canvas'), frame = document.getElementById('frame');
        const field = document.getElementById('field');
        const pixels = () => {
            const image = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
            let coloured = 0, sum = 0;
            for (let k = 0; k < image.length; k += 4) {
                const [r, g, b] = [image[k], image[k + 1], image[k + 2]];
                if (Math.max(r, g, b) - Math.min(r, g, b) > 40) coloured++;
                sum = (sum * 31 + r + 256 * g + 65536 * b) % 1000003;
            }
            return [coloured, sum];
        };
        const key = (name) => canvas.dispatchEvent(new KeyboardEvent('keydown', { key: name, bubbles: true }));
        const seen = [pixels()];
        frame.value = 1; frame.dispatchEvent(new Event('input'));
        const moved = canvas.dataset.frame;
        seen.push(pixels());
        field.value = 'stress.xx'; field.dispatchEvent(new Event('change'));
        seen.push(pixels());
        key('ArrowLeft'); seen.push(pixels());
        key('.'); const stepped = canvas.dataset.frame; key(',');
        key('0'); seen.push(pixels());
        said(JSON.stringify({ seen, moved, stepped, drawn: canvas.dataset.drawn, field: canvas.dataset.field, painter: canvas.dataset.painter,
            label: canvas.getAttribute('aria-label'), plots: document.querySelectorAll('#curves .uplot').length,
            outcome: document.getElementById('outcome').textContent,
            facts: document.getElementById('facts').textContent,
            reachable: [...document.querySelectorAll('select, input, button, #canvas')].every((n) => n.tabIndex === 0) }));
    ";
    for (run, points, steps, units) in [
        (beam(), "360", ["1", "2"], ["kg/m,", "m2"]),
        (
            Run::text(CUBE).set("output.fields=[\"stress\"]").set("output.every=1").set("petsc="),
            "",
            ["1", "2"],
            ["kg,", "m3"],
        ),
    ] {
        let page = run.results().text("report.html");
        for (flag, painter) in
            [("--enable-unsafe-swiftshader", "webgl"), ("--disable-3d-apis", "squares")]
        {
            let said = browsed(&browser, &page, script, flag);
            let found: Value =
                serde_json::from_str(&said.replace("&lt;", "<").replace("&gt;", ">"))
                    .unwrap_or_else(|_| panic!("{said}"));
            let seen: Vec<(u64, u64)> = serde_json::from_value(found["seen"].clone()).unwrap();
            assert!(seen.iter().all(|(coloured, _)| *coloured > 2000), "{said}");
            // Frame, field and view each change the picture; the reset brings it back.
            for (a, b) in [(0, 1), (1, 2), (2, 3)] {
                assert_ne!(seen[a].1, seen[b].1, "{a} {b}: {said}");
            }
            assert_eq!(seen[2], seen[4], "{said}");
            assert_eq!([&found["moved"], &found["stepped"]], steps, "{said}");
            assert_eq!(found["field"], "stress.xx");
            assert_eq!(found["reachable"], true);
            assert!(found["plots"].as_u64().unwrap() >= 3, "{said}");
            assert!(found["outcome"].as_str().unwrap().starts_with("completed"), "{said}");
            let facts = found["facts"].as_str().unwrap();
            assert!(units.iter().all(|unit| facts.contains(&format!(" {unit}"))), "{facts}");
            assert!(points.is_empty() || found["drawn"] == points, "{said}");
            assert_eq!(found["painter"], painter, "{said}");
        }
    }
}
