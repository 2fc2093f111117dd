//! The schema, its defaults, and what is written from it.

use std::path::Path;

use mpm_par::deck::schema::{self, Kind, Need};
use mpm_par::deck::{self, Deck, reference};

const DECKS: [&str; 5] = [
    include_str!("decks/beam.toml"),
    include_str!("decks/collision.toml"),
    include_str!("decks/annulus.toml"),
    include_str!("decks/cube.toml"),
    include_str!("decks/ghost.toml"),
];

fn read(text: &str, sets: &[&str]) -> Deck {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_string()).collect();
    deck::read(Path::new("deck.toml"), text, &sets).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn documentation_is_that_of_the_schema() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/guide/deck.md");
    let text = reference::markdown();
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, &text).expect("docs/guide/deck.md can be written");
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        found == text,
        "docs/guide/deck.md is old: UPDATE_DOCS=1 cargo test --test deck_reference"
    );
}

#[test]
fn the_documented_example_is_a_deck() {
    assert_eq!(read(reference::EXAMPLE, &[]).bodies[0].name, "beam");
}

/// A default that its own check refuses would fail every deck that relies on it.
#[test]
fn defaults_pass_their_own_checks() {
    for section in schema::sections() {
        for key in section.keys {
            let Need::Default(text) = key.need else { continue };
            let table: toml::Table = toml::from_str(&format!("v = {text}")).expect(text);
            let name = format!("{}.{}", section.name, key.name);
            match (key.kind, &table["v"]) {
                (Kind::Number, value) => {
                    let value = value.as_float().or(value.as_integer().map(|i| i as f64));
                    assert!(key.range.contains(value.expect(&name)), "{name}");
                }
                (Kind::Count, value) => {
                    assert!(key.range.contains(value.as_integer().expect(&name) as f64), "{name}");
                }
                (Kind::Choice(words), value) => {
                    assert!(words.contains(&value.as_str().expect(&name)), "{name}");
                }
                (Kind::Choices(words), value) => {
                    for word in value.as_array().expect(&name) {
                        assert!(words.contains(&word.as_str().expect(&name)), "{name}");
                    }
                }
                (Kind::Text, value) => assert!(value.is_str(), "{name}"),
                (Kind::Flag, value) => assert!(value.is_bool(), "{name}"),
                (Kind::Special(_), _) => {}
                (kind, _) => panic!("{name}: no check for a default of {kind:?}"),
            }
        }
    }
}

/// Giving every default of a section in full is the same as leaving it out.
#[test]
fn defaults_given_are_defaults_left_out() {
    for section in ["analysis", "method", "output", "parallel"] {
        let mut sets = Vec::new();
        let cube = read(DECKS[3], &[]);
        for key in schema::section(section).keys.iter().filter(|key| deck::is_read(&cube, key)) {
            if let Need::Default(text) = key.need {
                sets.push(format!("{section}.{}={text}", key.name));
            }
        }
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        assert_eq!(read(DECKS[3], &sets), read(DECKS[3], &[]), "{section}");
    }
}

#[test]
fn resolved_deck_reads_back_to_the_same_deck() {
    let changes: [&[&str]; 4] = [
        &[],
        &["title=\"another\"", "petsc.qs_a=[]", "petsc.qs_a="],
        &["body.0.density=2e3", "title=\"tab\\t \\\" back \\\\\""],
        &["output.checkpoint={ every = 3, minutes = 2.5 }"],
    ];
    for text in DECKS {
        for sets in changes {
            let deck = read(text, sets);
            let written = deck::resolved(&deck);
            let again = deck::read(Path::new("deck.toml"), &written, &[])
                .unwrap_or_else(|error| panic!("{error}\n{written}"));
            assert_eq!(deck, again, "{written}");
            assert_eq!(deck::resolved(&again), written);
        }
    }
    let explicit = ["method.velocity_update=xpic", "method.mass=lumped", "parallel.brick=4"];
    let affine = [
        "method.velocity_update=tpic",
        "method.basis=gimp",
        "method.gimp_edge=continued",
        "method.stress_update=musl",
        "method.mass=lumped",
    ];
    for sets in [&explicit[..], &affine, &["method.position_update=published"]] {
        let deck = read(DECKS[1], sets);
        assert_eq!(deck, Deck { notes: deck.notes.clone(), ..read(&deck::resolved(&deck), &[]) });
    }
    let conditioning = read(
        DECKS[4],
        &["analysis={ type = \"conditioning\", steps = 9 }", "conditioning.displacement=[2, 0]"],
    );
    let again = read(&deck::resolved(&conditioning), &[]);
    assert_eq!(Deck { notes: Vec::new(), ..conditioning }, again);
    for sets in [
        ["grid.generate=", "grid.file=ring.msh", "grid.motion.rotate_with=inner"],
        ["grid.motion={ follow = [\"x\"] }", "body.0.gauss=", "title=a"],
    ] {
        let mesh = read(DECKS[2], &sets);
        assert_eq!(mesh, read(&deck::resolved(&mesh), &[]));
    }
    let moving = read(DECKS[3], &["body.0.velocity=[\"2\", 3.0, 0]"]);
    assert_eq!(moving, read(&deck::resolved(&moving), &[]));
    let implicit = read(DECKS[3], &["analysis.hht_alpha=-0.05"]);
    assert_eq!(implicit, read(&deck::resolved(&implicit), &[]));
}

/// Every deck of `inputs/`, with a resolved deck that the next restart and the next reader take for it.
#[test]
fn resolved_decks_of_all_inputs_read_back_to_them() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("inputs");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).expect("inputs/") {
        let path = entry.expect("a file").path();
        if path.extension().is_none_or(|ending| ending != "toml") {
            continue;
        }
        let text = std::fs::read_to_string(&path).expect("text");
        let read = |text: &str| {
            deck::read(&path, text, &[]).unwrap_or_else(|error| panic!("{error}\n{text}"))
        };
        let (first, again) = (read(&text), read(&deck::resolved(&read(&text))));
        assert_eq!(Deck { notes: first.notes.clone(), ..again }, first, "{}", path.display());
        count += 1;
    }
    assert!(count > 50, "{count} decks");
}

#[test]
fn resolved_deck_tells_every_default() {
    for text in DECKS {
        let written: toml::Table = toml::from_str(&deck::resolved(&read(text, &[]))).expect("TOML");
        for name in ["analysis", "method", "output", "parallel"] {
            let deck = read(text, &[]);
            for key in schema::section(name).keys.iter().filter(|key| deck::is_read(&deck, key)) {
                if matches!(key.need, Need::Default(_)) {
                    assert!(written[name].get(key.name).is_some(), "{name}.{}", key.name);
                }
            }
        }
    }
}
