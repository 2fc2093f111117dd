//! Options database: built-in values that the user can override, and options nobody has read.

use std::collections::BTreeSet;
use std::ptr::{null, null_mut};
use std::sync::Mutex;

use super::check::{c_text, free, petsc, require_running, text_of};
use super::sys;
use crate::error::Result;

/// Names set by the program itself: that they go unread is not reported.
static BUILT_IN: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());

/// Sets option `name` (with or without its dash) where the user has not set it. "" for a bare
/// flag. A second call with the same name wins over the first: both are the program's.
pub fn set_default(name: &str, value: &str) -> Result<()> {
    require_running()?;
    let name = dashed(name);
    let ours = built_in(|names| names.contains(&name));
    if !ours && is_set(&name)? {
        return Ok(());
    }
    set(&name, value)?;
    built_in(|names| names.insert(name));
    Ok(())
}

/// Sets an option, whoever set it before. "" for a bare flag.
pub fn set(name: &str, value: &str) -> Result<()> {
    require_running()?;
    let (key, text) = (c_text(&dashed(name))?, c_text(value)?);
    let text = if value.is_empty() { null() } else { text.as_ptr() };
    petsc!(PetscOptionsSetValue(null_mut(), key.as_ptr(), text))
}

/// Is the option set, by whomever? Asking does not count as reading it.
pub fn is_set(name: &str) -> Result<bool> {
    let name = dashed(name);
    Ok(all()?.split_whitespace().any(|word| word.eq_ignore_ascii_case(&name)))
}

/// Is the option set, and not by [`set_default`]? Asking does not count as reading it.
pub fn is_users(name: &str) -> Result<bool> {
    Ok(!built_in(|names| names.contains(&dashed(name))) && is_set(name)?)
}

/// The whole database as PETSc prints it.
fn all() -> Result<String> {
    require_running()?;
    let text = petsc!(PetscOptionsGetAll(null_mut()) -> null_mut())?;
    let all = text_of(text);
    free(text);
    Ok(all)
}

/// The option's value ("" for a bare flag). Asking counts as reading it.
pub fn get(name: &str) -> Result<Option<String>> {
    require_running()?;
    let key = c_text(&dashed(name))?;
    let mut value = null();
    let found = petsc!(PetscOptionsFindPair(null_mut(), null(), key.as_ptr(), &mut value) -> sys::PETSC_FALSE)?;
    Ok((found != sys::PETSC_FALSE).then(|| text_of(value)))
}

/// Removes an option, whoever set it.
pub fn clear(name: &str) -> Result<()> {
    require_running()?;
    let key = c_text(&dashed(name))?;
    petsc!(PetscOptionsClearValue(null_mut(), key.as_ptr()))
}

/// Removes the options that start like this, whoever set them, and what is known of them.
pub fn clear_all(prefix: &str) -> Result<()> {
    let prefix = dashed(prefix);
    for name in all()?.split_whitespace().filter(|word| word.starts_with(&prefix)) {
        clear(name)?;
    }
    built_in(|names| names.retain(|name| !name.starts_with(&prefix)));
    Ok(())
}

/// Options set by the user and read by no object so far, as `-name value`.
pub fn unused() -> Result<Vec<String>> {
    let ours = |name: &String| built_in(|names| names.contains(name));
    let theirs = unread()?.into_iter().filter(|(name, _)| !ours(name));
    let mut left: Vec<String> = theirs
        .map(|(name, value)| if value.is_empty() { name } else { format!("{name} {value}") })
        .collect();
    left.sort();
    Ok(left)
}

/// Removes the program's own defaults that no object has read: newer versions of PETSc end with a warning of
/// them, as if the user had misspelt one.
pub fn clear_unread_defaults() -> Result<()> {
    for (name, _) in unread()? {
        if built_in(|names| names.contains(&name)) {
            clear(&name)?;
        }
    }
    Ok(())
}

/// Name and value of the options that no object has read.
fn unread() -> Result<Vec<(String, String)>> {
    require_running()?;
    let (mut count, mut names, mut values) = (0, null_mut(), null_mut());
    petsc!(PetscOptionsLeftGet(null_mut(), &mut count, &mut names, &mut values))?;
    // SAFETY: PETSc returned `count` names and values; a value may be null.
    let text = |k: usize| unsafe { (dashed(&text_of(*names.add(k))), text_of(*values.add(k))) };
    let left = (0..count as usize).map(text).collect();
    petsc!(PetscOptionsLeftRestore(null_mut(), &mut count, &mut names, &mut values))?;
    Ok(left)
}

fn dashed(name: &str) -> String {
    format!("-{}", name.trim_start_matches('-'))
}

fn built_in<R>(act: impl FnOnce(&mut BTreeSet<String>) -> R) -> R {
    act(&mut BUILT_IN.lock().unwrap_or_else(|poisoned| poisoned.into_inner()))
}
