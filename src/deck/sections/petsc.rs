//! `[petsc]`: options of the program's solvers.
//!
//! A deck may come from anybody. PETSc's options can load libraries, start a debugger and write
//! files at any place; those belong to the command line, whose words are the user's own. A deck sets
//! what solvers compute with, and nothing that names a file.

use crate::deck::problems::Got;
use crate::deck::reader::Table;
use crate::deck::tree::{Node, Value};

/// Prefixes of the program's solvers: equilibrium, mass, extreme eigenvalues.
pub const PREFIXES: [&str; 3] = ["qs_", "mass_", "kappa_"];
/// Beginnings of solvers' options that lack their prefix.
const OF_SOLVERS: [&str; 5] = ["ksp_", "pc_", "snes_", "mg_", "mat_mumps_"];
/// Allowed besides, without a value: PETSc's table of times on the terminal.
const BARE: [&str; 1] = ["log_view"];
/// Parts of the names of options that print.
const PRINTING: [&str; 4] = ["view", "monitor", "reason", "plot"];
/// Parts of the names of options whose value is a file or a folder however it is spelt.
const OF_FILES: [&str; 5] = ["tmpdir", "filename", "viewer", "_file", "python"];

/// Option names without a dash, with their values as PETSc reads them.
pub fn petsc(root: &Table<'_>) -> Got<Vec<(String, String)>> {
    let Some(node) = root.node("petsc") else { return Ok(Vec::new()) };
    let Value::Table(entries) = &node.value else { return Err(root.wrong("petsc", node)) };
    let options: Vec<Got<(String, String)>> = entries
        .iter()
        .map(|entry| {
            let key = format!("petsc.{}", entry.key);
            let name = entry.key.trim_start_matches('-').to_string();
            let option = value_of(&entry.node)
                .and_then(|value| check(&name, &value).map(|()| (name, value)));
            option.map_err(|message| {
                root.problems().report(&entry.node.origin, &key, message, String::new())
            })
        })
        .collect();
    options.into_iter().collect()
}

fn value_of(node: &Node) -> Result<String, String> {
    match &node.value {
        Value::String(text) if text.chars().any(|c| c.is_control() || c == '"') => {
            Err("expected one line without quotes".to_string())
        }
        Value::String(text) => Ok(text.clone()),
        Value::Boolean(true) => Ok(String::new()),
        Value::Boolean(false) => Ok("false".to_string()),
        Value::Integer(number) => Ok(number.to_string()),
        Value::Float(number) => Ok(format!("{number:?}")),
        _ => Err(format!("expected a string, number or true, found {}", node.describe())),
    }
}

/// Error: why a deck may not set this, and what would be right.
fn check(name: &str, value: &str) -> Result<(), String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if name.is_empty() || !name.chars().all(plain) {
        return Err("expected the name of a PETSc option".to_string());
    }
    let on_the_command_line = "give it on the command line, as -NAME VALUE";
    if BARE.contains(&name) {
        return match value {
            "" => Ok(()),
            _ => Err(format!("a deck writes no files: expected true; or {on_the_command_line}")),
        };
    }
    let Some(own) = PREFIXES.iter().find_map(|prefix| name.strip_prefix(prefix)) else {
        let hint = match OF_SOLVERS.iter().any(|begin| name.starts_with(begin)) {
            true => format!("; did you mean \"qs_{name}\"?"),
            false => String::new(),
        };
        return Err(format!(
            "a deck sets options of the program's solvers only, which begin with {}{hint}; for any \
             other {on_the_command_line}",
            PREFIXES.join(", ")
        ));
    };
    // PETSc takes capital and small letters alike.
    let (own, word) = (own.to_ascii_lowercase(), value.to_ascii_lowercase());
    let names_file = OF_FILES.iter().any(|part| own.contains(part) || word == *part);
    let printing = PRINTING.iter().any(|part| own.contains(part));
    let harmless = match printing {
        true => is_terminal(value),
        false => value.chars().all(|c| plain(c) || "+-.,".contains(c)),
    };
    // A word with a dash before a letter would be an option of its own.
    let mut letters = value.chars();
    let is_option = letters.next() == Some('-')
        && letters.next().is_some_and(|c| c.is_alphabetic() || c == '_' || c == '-')
        && value.parse::<f64>().is_err();
    if names_file || !harmless || is_option {
        return Err(format!(
            "a deck names no files, libraries or viewers: expected a number, a word or true; or \
             {on_the_command_line}"
        ));
    }
    Ok(())
}

/// True for a viewer `kind:file:format` that prints on the terminal, and for numbers and flags.
fn is_terminal(value: &str) -> bool {
    let mut parts = value.split(':');
    let kind = parts.next().unwrap_or_default();
    let file = parts.next().unwrap_or_default();
    let format = parts.next().unwrap_or_default();
    let flag = ["", "ascii", "true", "false", "yes", "no", "on", "off"].contains(&kind);
    (flag || kind.parse::<f64>().is_ok())
        && ["", "stdout", "stderr"].contains(&file)
        && format.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
        && parts.next().is_none()
}

#[cfg(test)]
mod tests {
    use super::check;

    #[test]
    fn options_of_solvers_pass() {
        for (name, value) in [
            ("qs_ksp_type", "cg"),
            ("qs_ksp_rtol", "1e-8"),
            ("mass_pc_type", "jacobi"),
            ("kappa_ksp_max_it", "100"),
            ("qs_ksp_chebyshev_eigenvalues", "-0.1,2.5"),
            ("qs_mat_mumps_icntl_7", "-1"),
            ("qs_mg_levels_1_pc_type", "sor"),
            ("qs_ksp_monitor", ""),
            ("qs_ksp_view", "ascii::ascii_info_detail"),
            ("qs_snes_monitor", ":stdout"),
            ("qs_ksp_monitor_pause_final", "1"),
            ("log_view", ""),
        ] {
            assert_eq!(check(name, value), Ok(()), "{name} {value}");
        }
    }

    #[test]
    fn what_loads_or_writes_is_the_command_lines() {
        for (name, value) in [
            ("dll_append", "/tmp/evil.so"),
            ("dll_prepend", "evil"),
            ("start_in_debugger", "noxterm"),
            ("debug_terminal", "sh -c"),
            ("on_error_attach_debugger", ""),
            ("options_file", "more"),
            ("options_string", "-dll_append evil"),
            ("prefix_push", "qs_"),
            ("log_view", ":F"),
            ("log_view", "F"),
            ("log", "F"),
            ("log_trace", "F"),
            ("history", "F"),
            ("info", ":F"),
            ("malloc_view", "F"),
            ("options_view", ":F"),
            ("viewer_binary_filename", "F"),
            ("qs_ksp_view", "ascii:F"),
            ("qs_ksp_view", ":F"),
            ("qs_ksp_view_mat", "binary"),
            ("qs_ksp_monitor", "draw"),
            ("qs_ksp_view", "socket:host"),
            ("qs_ksp_monitor", "F"),
            ("qs_ksp_rtol", "/etc/passwd"),
            ("qs_ksp_type", "-dll_append"),
            ("qs_ksp_type", "cg -dll_append evil"),
            ("qs_ksp_monitor", "-log_view"),
            ("qs_mat_mumps_ooc_tmpdir", "here"),
            ("qs_pc_type", "python"),
            ("qs_pc_python_type", "evil"),
            ("QS_ksp_type", "cg"),
            ("qs_ksp_View", "binary"),
            ("qs_ksp_type=cg", ""),
        ] {
            let why = check(name, value).expect_err(name);
            assert!(why.contains("command line") || why.contains("name of a PETSc"), "{why}");
        }
        let why = check("ksp_type", "cg").unwrap_err();
        assert!(why.contains("did you mean \"qs_ksp_type\"?"), "{why}");
    }
}
