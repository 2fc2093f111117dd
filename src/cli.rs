//! temporary
use std::path::PathBuf;
pub struct Arguments {
    pub input: PathBuf,
    pub sets: Vec<String>,
    pub out: PathBuf,
    pub check: bool,
    pub restart: Option<String>,
    pub force: bool,
    pub petsc: Vec<String>,
}
pub fn parse(w: &[String]) -> crate::error::Result<Arguments> {
    let mut a = Arguments {
        input: w[0].clone().into(),
        sets: vec![],
        out: PathBuf::from("out").join(PathBuf::from(&w[0]).file_stem().unwrap()),
        check: false,
        restart: None,
        force: false,
        petsc: vec![],
    };
    let mut i = 1;
    while i < w.len() {
        match w[i].as_str() {
            "--set" => {
                i += 1;
                a.sets.push(w[i].clone())
            }
            "--out" => {
                i += 1;
                a.out = w[i].clone().into()
            }
            "--force" => a.force = true,
            "--check" => a.check = true,
            x => a.petsc.push(x.into()),
        }
        i += 1;
    }
    Ok(a)
}
