//! Links in the repository's pages lead somewhere: the file exists, the heading too, and a page of the
//! book stays within the book.

use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// README.md and its like, and the pages of docs/ and jobs/, named from the root.
fn pages() -> Vec<PathBuf> {
    let mut pages = Vec::new();
    let mut folders: Vec<PathBuf> = ["", "docs", "jobs"].map(PathBuf::from).into();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(root().join(&folder)).expect("a folder can be listed") {
            let name = entry.expect("a folder can be listed").file_name();
            let path = folder.join(name);
            if path.extension().is_some_and(|end| end == "md") {
                pages.push(path);
            } else if folder != Path::new("") && root().join(&path).is_dir() {
                folders.push(path);
            }
        }
    }
    pages.sort();
    pages
}

/// Lines outside code blocks, numbered from 1, without `code`.
fn prose(text: &str) -> Vec<(usize, String)> {
    let (mut lines, mut code) = (Vec::new(), false);
    for (number, line) in text.lines().enumerate() {
        if line.trim_start().starts_with("```") {
            code = !code;
        } else if !code {
            let line: Vec<&str> = line.split('`').step_by(2).collect();
            lines.push((number + 1, line.concat()));
        }
    }
    lines
}

/// Targets of `[text](target)` in a line.
fn targets(line: &str) -> Vec<String> {
    line.split("](").skip(1).filter_map(|rest| Some(rest.split_once(')')?.0.to_string())).collect()
}

/// The names by which headings are linked to: GitHub's and mdBook's rule.
fn headings(text: &str) -> BTreeSet<String> {
    let mut code = false;
    let mut names = BTreeSet::new();
    for line in text.lines() {
        code ^= line.trim_start().starts_with("```");
        let title = line.trim_start_matches('#');
        if !code && title.len() < line.len() && title.starts_with(' ') {
            let kept = |c: &char| c.is_alphanumeric() || "-_ ".contains(*c);
            let name: String = title.trim().to_lowercase().chars().filter(kept).collect();
            names.insert(name.replace(' ', "-"));
        }
    }
    names
}

/// `a/b/../c` as `a/c`.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => _ = plain.pop(),
            Component::CurDir => {}
            part => plain.push(part),
        }
    }
    plain
}

/// What is wrong with a link of `page`, if anything.
fn fault(page: &Path, target: &str) -> Option<String> {
    if target.split_once(':').is_some_and(|(scheme, _)| scheme.chars().all(char::is_alphabetic)) {
        return None;
    }
    let (file, heading) = target.split_once('#').unwrap_or((target, ""));
    let folder = page.parent().expect("a page has a folder");
    let path = if file.is_empty() { page.to_path_buf() } else { plain(&folder.join(file)) };
    let there = root().join(&path);
    if !there.exists() {
        return Some("no such file".into());
    }
    if page.starts_with("docs") && !path.starts_with("docs") {
        return Some("leaves the book: name the file instead".into());
    }
    if page.starts_with("docs") && there.is_dir() {
        return Some("a folder has no page in the book".into());
    }
    if !heading.is_empty() && path.extension().is_some_and(|end| end == "md") {
        let text = std::fs::read_to_string(&there).expect("a page is text");
        if !headings(&text).contains(heading) {
            return Some("no such heading".into());
        }
    }
    None
}

#[test]
fn every_link_leads_somewhere() {
    let (mut links, mut faults) = (0, Vec::new());
    for page in pages() {
        let text = std::fs::read_to_string(root().join(&page)).expect("a page is text");
        for (number, line) in prose(&text) {
            for target in targets(&line) {
                links += 1;
                if let Some(why) = fault(&page, &target) {
                    faults.push(format!("{}:{number}: {target}: {why}", page.display()));
                }
            }
        }
    }
    assert!(links > 100, "{links} links are found");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn the_check_sees_what_is_wrong() {
    let page = Path::new("docs/guide/start.md");
    for (target, right) in [
        ("deck.md", true),
        ("deck.md#shape", true),
        ("https://petsc.org", true),
        ("deck.md#no-such-heading", false),
        ("no-such-page.md", false),
        ("../../README.md", false),
        ("../develop/log/", false),
    ] {
        assert_eq!(fault(page, target).is_none(), right, "{target}");
    }
    assert_eq!(targets("see [a](b.md) and ![c](d.png)"), ["b.md", "d.png"]);
    assert_eq!(prose("a `[x](y)`\n```\n[x](y)\n```\n").len(), 1);
}
