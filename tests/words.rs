//! Command lines that run nothing: `--list`, `--explain`, `--schema`, `--new`, completions and the
//! manual page work without mpirun, and end with 0.

mod common;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use common::run::Run;
use mpm_par::deck::json_schema::json_schema;
use mpm_par::deck::reference;
use mpm_par::deck::templates::TEMPLATES;
use serde_json::Value;

fn program(folder: &Path, words: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_mpm-par"));
    program.args(words).current_dir(folder).output().expect("the program")
}

#[track_caller]
fn says(words: &[&str]) -> String {
    let output = program(Path::new("."), words);
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{words:?}: {error}");
    String::from_utf8(output.stdout).expect("text")
}

#[test]
fn texts_are_printed_without_mpi() {
    for (words, part) in [
        (&["--list"][..], "mohr-coulomb"),
        (&["--list"], "mobilised_friction"),
        (&["--explain", "analysis.steps"], "a whole number"),
        (&["--explain=young"], "Pa"),
        (&["--schema"], "\"additionalProperties\": false"),
        (&["--help"], "--explain <WORD>"),
        (&["deck.toml", "-V"], env!("CARGO_PKG_VERSION")),
        (&["completions", "bash"], "--restart"),
        (&["man"], ".TH mpm-par"),
        (&["man", "--help"], "manual page"),
    ] {
        assert!(says(words).contains(part), "{words:?}");
    }
    for (words, code, part) in [
        (&["--explain", "analysis.step"][..], 2, "did you mean \"steps\"?"),
        (&["--new", "slop"], 2, "did you mean \"slope\"?"),
        (&["completions", "basch"], 2, "basch"),
        (&["--explain"], 2, "--explain <WORD>"),
    ] {
        let output = program(Path::new("."), words);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{words:?}: {text}");
        assert!(text.contains(part), "{words:?}: {text}");
    }
    // Under mpirun one rank speaks.
    let words = [env!("CARGO_BIN_EXE_mpm-par"), "--list"];
    let output = common::mpirun(3, &words, &[]);
    assert!(output.status.success());
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(text.matches("templates (").count(), 1);
}

#[test]
fn a_new_deck_is_written_once() {
    let folder = tempfile::tempdir().unwrap();
    let slope = folder.path().join("slope.toml");
    let output = program(folder.path(), &["--new", "slope"]);
    assert!(output.status.success());
    let text = std::fs::read_to_string(&slope).expect("a deck");
    assert_eq!(String::from_utf8_lossy(&output.stdout), text);
    std::fs::write(&slope, "mine").unwrap();
    let output = program(folder.path(), &["--new", "slope"]);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(std::fs::read_to_string(&slope).unwrap(), "mine");
    assert!(program(folder.path(), &["--new", "slope", "--force"]).status.success());
    assert_eq!(std::fs::read_to_string(&slope).unwrap(), text);
    // Redirected, it goes there alone.
    let file = std::fs::File::create(folder.path().join("mine.toml")).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_mpm-par"));
    command.args(["--new", "beam"]).current_dir(folder.path()).stdout(file);
    let output = command.output().unwrap();
    assert!(output.status.success());
    assert!(String::from_utf8_lossy(&output.stderr).contains("beam.toml was not written"));
    assert!(std::fs::read_to_string(folder.path().join("mine.toml")).unwrap().contains("[grid]"));
    assert!(!folder.path().join("beam.toml").exists());
    // Into a log it does not go alone.
    let file = std::fs::File::create(folder.path().join("job.log")).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_mpm-par"));
    command.args(["--new", "beam"]).current_dir(folder.path()).stdout(file);
    assert!(command.status().unwrap().success());
    assert!(std::fs::read_to_string(folder.path().join("beam.toml")).unwrap().contains("[grid]"));
}

/// As short as shows that it runs; the whole is what `--check` looks at.
fn shortened(name: &str) -> &'static [&'static str] {
    match name {
        "beam" => &["analysis.steps=4", "load.0.point.force=[0, -20e3]"],
        "slope" => &["analysis.steps=3"],
        "footing" => &["analysis.steps=2", "boundary.3.displacement={ y = -0.015 }"],
        "excavation" => &["stage.1.steps=1", "stage.2.steps=1"],
        "cone" => &["analysis.steps=3", "rigid.0.motion.displacement=[0, -0.0015]"],
        "column-collapse" => &["analysis.duration=0.02"],
        "collision" => &["analysis.duration=0.1"],
        "triaxial" => &["element_test.steps=10"],
        _ => panic!("{name}: say here how a shortened run goes"),
    }
}

#[test]
fn templates_run() {
    for template in TEMPLATES {
        let check = Run::text(template.text).word("--check").attempt();
        assert_eq!(check.code, 0, "{}: {}", template.name, check.stderr);
        assert!(!check.stdout.contains("warning"), "{}: {}", template.name, check.stdout);
        let run = Run::text(template.text).ranks(2);
        let run = shortened(template.name).iter().fold(run, |run, set| run.set(*set));
        let results = run.results();
        assert_eq!(results.summary["status"], "completed", "{}", template.name);
        assert_eq!(results.summary["warnings"], serde_json::json!([]), "{}", template.name);
        let lines = template.text.lines();
        assert!(lines.clone().count() <= 100 && lines.into_iter().all(|line| line.len() <= 120));
    }
}

/// Every deck of the project.
fn decks() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = Vec::new();
    for folder in ["inputs", "tests/decks", "src/deck/templates"] {
        let entries = std::fs::read_dir(root.join(folder)).expect("a folder");
        found.extend(entries.map(|entry| entry.expect("an entry").path()));
    }
    found.retain(|path| path.extension().is_some_and(|end| end == "toml"));
    found.sort();
    assert!(found.len() > 40, "{found:?}");
    found
}

fn as_json(text: &str) -> Value {
    let table: toml::Table = text.parse().expect("TOML");
    serde_json::to_value(table).expect("JSON")
}

/// What a validator of draft 7 finds, for the words that the schema uses.
fn faults(root: &Value, schema: &Value, value: &Value, at: &str, found: &mut Vec<String>) {
    let mut fault = |why: String| found.push(format!("{at}: {why}"));
    if let Some(reference) = schema["$ref"].as_str() {
        let place = root.pointer(&reference[1..]).expect("a reference leads somewhere");
        return faults(root, place, value, at, found);
    }
    let right = match schema["type"].as_str() {
        None => true,
        Some("object") => value.is_object(),
        Some("array") => value.is_array(),
        Some("string") => value.is_string(),
        Some("boolean") => value.is_boolean(),
        Some("number") => value.is_number(),
        Some("integer") => value.is_i64() || value.is_u64(),
        Some(other) => panic!("type {other}"),
    };
    if !right {
        return fault(format!("{value} is no {}", schema["type"]));
    }
    if schema["enum"].as_array().is_some_and(|words| !words.contains(value)) {
        fault(format!("{value} is none of {}", schema["enum"]));
    }
    if schema.get("const").is_some_and(|word| word != value) {
        fault(format!("{value} is not {}", schema["const"]));
    }
    if let (Some(number), bound) = (value.as_f64(), |name: &str| schema[name].as_f64()) {
        let beyond = bound("minimum").is_some_and(|low| number < low)
            || bound("maximum").is_some_and(|high| number > high)
            || bound("exclusiveMinimum").is_some_and(|low| number <= low)
            || bound("exclusiveMaximum").is_some_and(|high| number >= high);
        if beyond {
            fault(format!("{number} is out of range"));
        }
    }
    for needed in schema["required"].as_array().into_iter().flatten() {
        if value.get(needed.as_str().expect("a name")).is_none() {
            fault(format!("{needed} is missing"));
        }
    }
    for part in schema["allOf"].as_array().into_iter().flatten() {
        faults(root, part, value, at, found);
    }
    if let Some(any) = schema["anyOf"].as_array() {
        let mut all = Vec::new();
        let fits = any.iter().any(|part| {
            let mut own = Vec::new();
            faults(root, part, value, at, &mut own);
            let good = own.is_empty();
            all.extend(own);
            good
        });
        if !fits {
            found.extend(all);
        }
    }
    for (name, inner) in value.as_object().into_iter().flatten() {
        let place = format!("{at}.{name}");
        match (&schema["properties"][name], &schema["additionalProperties"]) {
            (Value::Null, Value::Bool(false)) => found.push(format!("{place}: unknown")),
            (Value::Null, Value::Null) => {}
            (Value::Null, others) => faults(root, others, inner, &place, found),
            (known, _) => faults(root, known, inner, &place, found),
        }
    }
    if let (Some(items), false) = (value.as_array(), schema["items"].is_null()) {
        for (index, item) in items.iter().enumerate() {
            faults(root, &schema["items"], item, &format!("{at}.{index}"), found);
        }
    }
}

#[test]
fn the_json_schema_takes_every_deck_and_refuses_slips() {
    let schema = json_schema();
    let of = |value: &Value| {
        let mut found = Vec::new();
        faults(&schema, &schema, value, "", &mut found);
        found
    };
    for path in decks() {
        let text = std::fs::read_to_string(&path).expect("a deck");
        let found = of(&as_json(&text));
        assert!(found.is_empty(), "{}: {found:?}", path.display());
    }
    for (from, to) in [
        ("poisson = 0.2", "poison = 0.2"),
        ("steps = 50", "steps = \"many\""),
        ("h = 0.5", "h = -0.5"),
        ("basis = \"gimp\"", "basis = \"gump\""),
        ("[grid]", "[gird]"),
    ] {
        assert!(reference::EXAMPLE.contains(from), "{from}");
        let found = of(&as_json(&reference::EXAMPLE.replace(from, to)));
        assert!(!found.is_empty(), "{to}");
    }
}

/// The same by a validator that is not written here, where Python has it.
#[test]
fn another_validator_agrees() {
    let python = std::env::var("MPM_PAR_PYTHON").unwrap_or_else(|_| "python3".into());
    let script = "import sys, json, tomllib, jsonschema\n\
        schema = json.load(open(sys.argv[1]))\n\
        jsonschema.Draft7Validator.check_schema(schema)\n\
        for path in sys.argv[2:]:\n    \
            jsonschema.Draft7Validator(schema).validate(tomllib.load(open(path, 'rb')))\n\
        print(len(sys.argv) - 2, 'decks')";
    let there = Command::new(&python).args(["-c", "import jsonschema, tomllib"]).output();
    if !there.is_ok_and(|output| output.status.success()) {
        println!("not run: {python} has no jsonschema (MPM_PAR_PYTHON names another Python)");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("schema.json");
    std::fs::write(&path, json_schema().to_string()).unwrap();
    let output =
        Command::new(&python).arg("-c").arg(script).arg(&path).args(decks()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
