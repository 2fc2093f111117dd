//! Decks to start from: `--new NAME`.

use super::problems::nearest;
use crate::error::{Error, Result};

/// A commented deck.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Template {
    /// As `--new` takes it.
    pub name: &'static str,
    /// The deck.
    pub text: &'static str,
}

const fn template(name: &'static str, text: &'static str) -> Template {
    Template { name, text }
}

/// In the order of `--list`; a file of `templates/` for each.
pub const TEMPLATES: &[Template] = &[
    template("beam", include_str!("templates/beam.toml")),
    template("slope", include_str!("templates/slope.toml")),
    template("footing", include_str!("templates/footing.toml")),
    template("excavation", include_str!("templates/excavation.toml")),
    template("cone", include_str!("templates/cone.toml")),
    template("column-collapse", include_str!("templates/column-collapse.toml")),
    template("triaxial", include_str!("templates/triaxial.toml")),
    template("collision", include_str!("templates/collision.toml")),
];

impl Template {
    /// The deck's title.
    pub fn title(&self) -> &'static str {
        let line = self.text.lines().find_map(|line| line.strip_prefix("title = \""));
        line.and_then(|rest| rest.strip_suffix('"')).unwrap_or(self.name)
    }
}

/// The template of that name.
///
/// # Errors
/// `Input` for an unknown one.
pub fn template_of(name: &str) -> Result<Template> {
    TEMPLATES.iter().find(|known| known.name == name).copied().ok_or_else(|| {
        let names: Vec<&str> = TEMPLATES.iter().map(|known| known.name).collect();
        let near = nearest(name, names.iter().copied());
        let hint = near.map_or(String::new(), |near| format!(" (did you mean \"{near}\"?)"));
        Error::Input(format!(
            "--new: no template is called \"{name}\"{hint}; there are {}",
            names.join(", ")
        ))
    })
}
