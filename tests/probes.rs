//! `[[probe]]`: the columns of `probes.csv` are the fields of the points that it names, on any number
//! of ranks and over a restart.

mod common;
#[path = "common/program.rs"]
mod program;

use std::fs;
use std::path::Path;

use common::run::{PointTable, Run, relative_difference};
use mpm_par::deck;
use program::{copy, deck as slump, run as start, run_well, text};

const PROBES: &str = r#"
[[probe]]
name = "crest"
near = [2.9, 2.9]
fields = ["displacement", "stress.yy", "principal_stress", "q"]

[[probe]]
name = "first"
id = 0
fields = ["log_strain.xy"]

[[probe]]
name = "block"
body = "block"
fields = ["displacement.y", "plastic_strain"]
"#;
const FIELDS: &str = r#"output.fields=["displacement","stress","principal_stress","q","log_strain","plastic_strain","position_initial"]"#;

/// The deck of the slumping block with probes.
fn watched() -> String {
    let text = fs::read_to_string(slump("restart")).expect("a deck");
    text.replace("[output]", &format!("{PROBES}\n[output]"))
}

fn table(folder: &Path) -> (Vec<String>, Vec<Vec<f64>>) {
    let text = fs::read_to_string(folder.join("probes.csv")).expect("probes.csv");
    let mut lines = text.lines();
    let header = lines.next().expect("a header").split(',').map(String::from).collect();
    let numbers = |line: &str| line.split(',').map(|n| n.parse().expect("a number")).collect();
    (header, lines.map(numbers).collect())
}

#[test]
fn columns_are_the_fields_of_the_points() {
    let mut first: Option<Vec<Vec<f64>>> = None;
    for ranks in 1..=3 {
        let results = Run::text(&watched()).ranks(ranks).set(FIELDS).results();
        let (header, rows) = table(&results.directory);
        assert_eq!(
            header.join(","),
            "step [-],load_factor [-],time [s],crest.displacement.x [m],crest.displacement.y [m],\
             crest.stress.yy [Pa],crest.principal_stress.1 [Pa],crest.principal_stress.2 [Pa],\
             crest.principal_stress.3 [Pa],crest.q [Pa],first.log_strain.xy [-],\
             block.displacement.y [m],block.plastic_strain [-]"
        );
        assert_eq!(rows.len(), 6);
        let points: PointTable = results.points(6);
        // The point at (2.875, 2.875), of sub-cells of 0.25.
        let start =
            (points.component("position_initial", 0), points.component("position_initial", 1));
        let crest = (0..points.id.len())
            .find(|&p| (start.0[p] - 2.875).abs() < 1e-12 && (start.1[p] - 2.875).abs() < 1e-12)
            .expect("a point near the corner");
        let at = |field: &str, component, p: usize| points.component(field, component)[p];
        let mean = |field: &str, component| {
            let values = points.component(field, component);
            values.iter().sum::<f64>() / values.len() as f64
        };
        let expected = [
            6.0,
            1.0,
            0.0,
            at("displacement", 0, crest),
            at("displacement", 1, crest),
            at("stress", 3, crest),
            at("principal_stress", 0, crest),
            at("principal_stress", 1, crest),
            at("principal_stress", 2, crest),
            at("q", 0, crest),
            at("log_strain", 1, 0),
            mean("displacement", 1),
            mean("plastic_strain", 0),
        ];
        for (k, (found, expected)) in rows[5].iter().zip(expected).enumerate() {
            let tolerance = 1e-12 * expected.abs();
            assert!((found - expected).abs() <= tolerance, "{}: {found} {expected}", header[k]);
        }
        let all: Vec<f64> = rows.concat();
        if let Some(first) = &first {
            let difference = relative_difference(&all, &first.concat());
            assert!(difference < 1e-8, "{ranks} ranks: {difference:e}");
        }
        first.get_or_insert(rows);
    }
}

#[test]
fn a_continued_run_continues_its_probes() {
    let folder = tempfile::tempdir().unwrap();
    let deck = folder.path().join("watched.toml");
    fs::write(&deck, watched()).unwrap();
    let (whole, part) = (folder.path().join("whole"), folder.path().join("part"));
    run_well(2, &deck, &whole, &[]);
    copy(&whole, &part);
    let middle = part.join("checkpoint-000003.h5").display().to_string();
    run_well(2, &deck, &part, &["--restart", &middle]);
    let of = |folder: &Path| fs::read_to_string(folder.join("probes.csv")).unwrap();
    assert_eq!(of(&part), of(&whole));
    // Probes are no part of the problem: a run goes on with others.
    let other = ["--restart", &middle, "--set", "probe.0.fields=[\"q\"]"];
    let refused = start(2, &deck, &part, &other);
    assert_eq!(refused.status.code(), Some(3), "{}", text(&refused));
    assert!(text(&refused).contains("probes.csv has other columns"), "{}", text(&refused));
    fs::remove_file(part.join("probes.csv")).unwrap();
    run_well(2, &deck, &part, &other);
    assert_eq!(table(&part).1.len(), 3);
}

#[test]
fn places_and_ids_without_a_point_are_refused() {
    for (set, words) in [
        ("probe.0.near=[7, 3]", "probe.0.near: [7.0, 3.0] m is 4."),
        ("probe.1.id=987654", "probe.1.id: no point has the id 987654"),
        ("probe.2.body=\"blok\"", "did you mean \"block\"?"),
        ("probe.0.fields=[\"stress.yx\"]", "expected one of \"stress.xx\""),
        ("probe.0.fields=[\"rank\"]", "does not change in time"),
        ("probe.0.id=3", "expected alone"),
        ("probe.1.id=", "expected one of \"near\", \"id\", \"body\""),
        ("probe.0.name=\"first\"", "another probe is called \"first\""),
    ] {
        let outcome = Run::text(&watched()).ranks(2).set(set).attempt();
        assert_eq!(outcome.code, 2, "{set}\n{}", outcome.stderr);
        assert!(outcome.said().contains(words), "{set}\n{}", outcome.said());
        assert_eq!(outcome.files(), ["deck.toml"], "{set}");
    }
}

#[test]
fn the_resolved_deck_has_the_probes() {
    let read = |text: &str| deck::read(Path::new("deck.toml"), text, &[]).expect("a good deck");
    let watched = read(&watched());
    assert_eq!(watched.probes.len(), 3);
    assert_eq!(read(&deck::resolved(&watched)).probes, watched.probes);
}
