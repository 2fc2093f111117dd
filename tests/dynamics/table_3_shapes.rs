//! What shape and time of contact do to Ghost Table 3.

use super::ghosts::MEDIUM;
use super::report::record;
use super::table_3::{PRINTED, Range, SPACINGS, collision, mean_error, of_all, time_of_contact};
use crate::common::run::Run;

/// Other bodies of about the same area and other times of contact: the spread that not knowing
/// the paper's points leaves.
#[test]
#[ignore = "84 runs, ten minutes; writes the table"]
fn table_3_of_other_shapes_and_times_of_contact() {
    let (mut rows, mut spread) = (Vec::new(), vec![Range::NONE; 12]);
    let printed: Vec<String> =
        PRINTED.iter().map(|m| m[1][0].map(|v| format!("{v:.2}")).join(" / ")).collect();
    rows.push([vec!["printed".into(), String::new()], printed].concat());
    for (name, change) in changes() {
        let mut runs = Vec::new();
        for method in 0..4 {
            // Bodies that meet early come back farther: a margin of two of the largest cells, as
            // the cells at the grid's edge have no Ghost faces towards it.
            runs.extend(SPACINGS.map(|h| {
                let run = collision(method, &MEDIUM, 1000, h);
                change(run.set("grid.origin=[-0.4, -0.4]").set("grid.size=[1.8, 1.8]"))
            }));
        }
        let found = of_all(&runs, |run| (mean_error(run), time_of_contact(run)));
        let times: Vec<String> = found[..3].iter().map(|(_, t)| format!("{t:.2}")).collect();
        let errors: Vec<String> = found
            .chunks(3)
            .map(|row| row.iter().map(|(e, _)| format!("{e:.2}")).collect::<Vec<_>>().join(" / "))
            .collect();
        rows.push([vec![name.to_string(), times.join(" / ")], errors].concat());
        for (range, (error, _)) in spread.iter_mut().zip(&found) {
            range.add(*error);
        }
    }
    let ratios: Vec<String> = spread
        .chunks(3)
        .map(|row| row.iter().map(|r| format!("{:.1}", r.1 / r.0)).collect::<Vec<_>>().join(" / "))
        .collect();
    rows.push([vec!["largest over smallest".into(), String::new()], ratios].concat());
    let header = ["bodies", "contact [s]", "usf ghost", "usf lumped", "usl ghost", "usl lumped"];
    record("ghost-3-shapes", &header, &rows);
    // Energy is lost to the grid in every case, and most by usl with the lumped mass.
    for h in 0..3 {
        assert!(spread[9 + h].0 > spread[6 + h].1, "{spread:?}");
    }
}

type Change = (&'static str, Box<dyn Fn(Run) -> Run>);

/// Names and settings of the variations, the deck's own bodies first.
fn changes() -> Vec<Change> {
    let nearer = |by: f64| {
        let lower = [0.0027891072329780313 + by, -0.0023727973147705046 + by];
        Box::new(move |run: Run| run.set(format!("body.0.shape.translate={lower:?}")))
    };
    // Both bodies lose a part of the shape, which keeps its place; the points stay on theirs.
    let without = |part: &'static str| {
        Box::new(move |run: Run| {
            run.set(format!("body.0.shape={}", shape(part, [0.00279, -0.00237])))
                .set(format!("body.1.shape={}", shape(part, [0.60056, 0.60210])))
        })
    };
    let turned = |run: Run| {
        run.set("body.1.shape.rotate={ degrees = 180, about = [0.2, 0.2] }")
            .set("body.1.shape.translate=[0.597, 0.602]")
    };
    let discs = |run: Run| {
        let disc =
            |c: f64| format!("{{ disc = {{ centre = [{c:?}, {c:?}], radius = 0.1848656 }} }}");
        run.set(format!("body.0.shape={}", disc(0.2))).set(format!("body.1.shape={}", disc(0.8)))
    };
    vec![
        ("the deck's", Box::new(|run| run)),
        ("1 cm nearer", nearer(0.01)),
        ("2 cm nearer", nearer(0.02)),
        ("5 cm nearer", nearer(0.05)),
        ("no skirt", without("skirt")),
        ("no eyes, no mouth", without("face")),
        ("no arms", without("arms")),
        ("upper one upside down", Box::new(turned)),
        ("discs of the same area", Box::new(discs)),
    ]
}

/// The deck's shape without a part.
fn shape(without: &str, translate: [f64; 2]) -> String {
    let skirt = match without {
        "skirt" => "",
        _ => "{ where = \"y >= 0.02230034950961722 * (1 + cos(8*pi*(x - 0.04)/0.32))\" },",
    };
    let arms = match without {
        "arms" => "",
        _ => "{ capsule = { from = [0.04, 0.2], to = [0.36, 0.2], radius = 0.04 } },",
    };
    let parts = format!(
        "{{ disc = {{ centre = [0.2, 0.24], radius = 0.16 }} }}, \
         {{ intersection = [ {{ box = {{ min = [0.04, 0.0], max = [0.36, 0.24] }} }}, \
         {{ box = {{ min = [0.0, 0.0], max = [0.4, 0.4] }} }}, {skirt} ] }}, {arms}"
    );
    if without == "face" {
        return format!("{{ union = [ {parts} ], translate = {translate:?} }}");
    }
    let ellipse = |x: f64, y: f64, a: f64, b: f64| {
        format!("{{ ellipse = {{ centre = [{x:?}, {y:?}], semi_axes = [{a:?}, {b:?}] }} }}")
    };
    let holes = [
        ellipse(0.14, 0.26, 0.02, 0.03),
        ellipse(0.26, 0.26, 0.02, 0.03),
        ellipse(0.2, 0.17, 0.03, 0.04),
    ]
    .join(", ");
    format!("{{ difference = [ {{ union = [ {parts} ] }}, {holes} ], translate = {translate:?} }}")
}
