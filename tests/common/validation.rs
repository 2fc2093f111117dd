//! Tables of the validation pages, rewritten in place by `make validate`.

use std::path::Path;
use std::sync::Mutex;

static ONE_WRITER: Mutex<()> = Mutex::new(());

/// [`record_in`] docs/evidence/validation.md.
pub fn record(name: &str, header: &[&str], rows: &[Vec<String>]) {
    record_in("validation.md", name, header, rows);
}

/// Replaces what stands between `<!-- table NAME -->` and `<!-- end -->` in a page of docs/evidence/ by
/// this table. Does nothing unless `MPM_PAR_VALIDATION` is set.
pub fn record_in(page: &str, name: &str, header: &[&str], rows: &[Vec<String>]) {
    if std::env::var_os("MPM_PAR_VALIDATION").is_none() {
        return;
    }
    let _alone = ONE_WRITER.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/evidence").join(page);
    let text =
        std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("docs/evidence/{page}: {e}"));
    let opening = format!("<!-- table {name} -->\n");
    let begin = text.find(&opening).unwrap_or_else(|| panic!("no place for table {name}"));
    let begin = begin + opening.len();
    let end = begin + text[begin..].find("<!-- end -->").expect("the end of the table's place");
    let mut table = format!("| {} |\n|{}\n", header.join(" | "), "---|".repeat(header.len()));
    for row in rows {
        table.push_str(&format!("| {} |\n", row.join(" | ")));
    }
    std::fs::write(&path, format!("{}{table}{}", &text[..begin], &text[end..]))
        .unwrap_or_else(|e| panic!("docs/evidence/{page}: {e}"));
}
