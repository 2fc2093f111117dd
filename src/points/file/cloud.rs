//! Points as a file has them.

use super::{Got, Refusal, wrong};
use crate::deck::model::PointNames;
use crate::deck::nearest;

/// An array of a VTK file with a row for each point.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    pub name: String,
    pub columns: usize,
    /// Row by row.
    pub values: Vec<f64>,
}

/// What a VTK file holds of its points.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Arrays {
    /// x, y, z of each.
    pub places: Vec<f64>,
    pub arrays: Vec<Array>,
}

/// Places, m, and what belongs to them.
pub struct Cloud<const D: usize> {
    pub places: Vec<[f64; D]>,
    pub volumes: Vec<f64>,
    /// Empty where the file has none.
    pub velocities: Vec<[f64; D]>,
    /// Empty where the file has none.
    pub bodies: Vec<f64>,
    /// Where the rows stand: lines of a text, else numbers of points.
    pub rows: Rows,
}

/// What the rows of a cloud are called.
pub enum Rows {
    Lines(Vec<u64>),
    Numbers(Vec<usize>),
}

impl<const D: usize> Cloud<D> {
    /// From a VTK file; `names` say what its arrays are called.
    ///
    /// # Errors
    /// No array of the volumes, arrays of wrong length or width, numbers that are not finite, places
    /// off the plane of a problem in two dimensions.
    pub fn of_arrays(data: Arrays, names: &PointNames) -> Got<Self> {
        let count = data.places.len() / 3;
        if count == 0 {
            return wrong("it holds no points");
        }
        let known: Vec<&str> = data.arrays.iter().map(|array| array.name.as_str()).collect();
        let find = |name: &str| data.arrays.iter().find(|array| array.name == name);
        let needed = |key: &str, given: &Option<String>, usual: &str| -> Got<Option<&Array>> {
            let name = given.as_deref().unwrap_or(usual);
            let array = find(name);
            if array.is_none() && given.is_some() {
                let hint = nearest(name, known.iter().copied());
                let hint = hint.map_or(String::new(), |near| format!(", did you mean \"{near}\"?"));
                return wrong(format!(
                    "its points have no array \"{name}\" (names.{key}){hint}; they have {}",
                    list(&known)
                ));
            }
            Ok(array)
        };
        let Some(volume) = needed("volume", &names.volume, "volume")? else {
            return wrong(format!(
                "its points have no array \"volume\"; they have {}; names = {{ volume = \"...\" }} beside \
                 points tells which of them holds the volumes",
                list(&known)
            ));
        };
        let velocity = needed("velocity", &names.velocity, "velocity")?;
        let body = needed("body", &names.body, "body")?;
        let shaped = |array: &Array, columns: &[usize]| -> Got<()> {
            if !columns.contains(&array.columns) || array.values.len() != count * array.columns {
                return wrong(format!(
                    "array \"{}\" has {} numbers in rows of {} for {count} points",
                    array.name,
                    array.values.len(),
                    array.columns
                ));
            }
            match array.values.iter().position(|value| !value.is_finite()) {
                Some(at) => wrong(format!(
                    "point {}: {} in array \"{}\" is not a finite number",
                    at / array.columns,
                    array.values[at],
                    array.name
                )),
                None => Ok(()),
            }
        };
        shaped(volume, &[1])?;
        velocity.map_or(Ok(()), |array| shaped(array, &[D, 3]))?;
        body.map_or(Ok(()), |array| shaped(array, &[1]))?;
        if let Some(at) = data.places.iter().position(|x| !x.is_finite()) {
            return wrong(format!("point {}: its place is not finite", at / 3));
        }
        if D == 2 {
            let heights = data.places.chunks_exact(3).map(|x| x[2]);
            let (low, high) = heights.fold((f64::MAX, f64::MIN), |(a, b), z| (a.min(z), b.max(z)));
            if low < high {
                return wrong(format!("the problem is 2D, but z goes from {low} to {high} m"));
            }
        }
        let vectors = |values: &[f64], width: usize| -> Vec<[f64; D]> {
            values.chunks_exact(width).map(|x| std::array::from_fn(|a| x[a])).collect()
        };
        Ok(Cloud {
            places: vectors(&data.places, 3),
            volumes: volume.values.clone(),
            velocities: velocity.map_or(Vec::new(), |array| vectors(&array.values, array.columns)),
            bodies: body.map_or(Vec::new(), |array| array.values.clone()),
            rows: Rows::Numbers((0..count).collect()),
        })
    }

    /// Keeps the points of one body. Without a choice a file of several bodies is refused: their points
    /// would all become one material.
    pub fn choose(&mut self, of_body: Option<usize>) -> Got<()> {
        let mut numbers = self.bodies.clone();
        numbers.sort_unstable_by(f64::total_cmp);
        numbers.dedup();
        let there = || {
            let words: Vec<String> = numbers.iter().map(|number| number.to_string()).collect();
            words.join(", ")
        };
        let Some(wanted) = of_body else {
            if numbers.len() > 1 {
                return wrong(format!(
                    "it has points of the bodies {}; of_body = ... beside points takes one of them",
                    there()
                ));
            }
            return Ok(());
        };
        if numbers.is_empty() {
            return wrong("of_body is given, but nothing in it tells bodies apart (body)");
        }
        let kept: Vec<usize> =
            (0..self.bodies.len()).filter(|&row| self.bodies[row] == wanted as f64).collect();
        if kept.is_empty() {
            return wrong(format!("it has no points of body {wanted}, only of {}", there()));
        }
        fn pick<T: Copy>(kept: &[usize], all: &mut Vec<T>) {
            if !all.is_empty() {
                *all = kept.iter().map(|&row| all[row]).collect();
            }
        }
        pick(&kept, &mut self.places);
        pick(&kept, &mut self.volumes);
        pick(&kept, &mut self.velocities);
        pick(&kept, &mut self.bodies);
        match &mut self.rows {
            Rows::Lines(lines) => pick(&kept, lines),
            Rows::Numbers(numbers) => pick(&kept, numbers),
        }
        Ok(())
    }

    /// `line 4`, `point 17`
    pub fn name_of(&self, row: usize) -> String {
        match &self.rows {
            Rows::Lines(lines) => format!("line {}", lines[row]),
            Rows::Numbers(numbers) => format!("point {}", numbers[row]),
        }
    }

    /// A fault of a row.
    pub fn fault(&self, row: usize, what: String) -> Refusal {
        match &self.rows {
            Rows::Lines(lines) => Refusal::Wrong(Some(lines[row]), what),
            Rows::Numbers(numbers) => {
                Refusal::Wrong(None, format!("point {}: {what}", numbers[row]))
            }
        }
    }
}

fn list(names: &[&str]) -> String {
    /// A file of another program may have hundreds.
    const MOST: usize = 12;
    if names.is_empty() {
        return "none at all".into();
    }
    let more = if names.len() > MOST { ", ..." } else { "" };
    names[..names.len().min(MOST)].join(", ") + more
}
