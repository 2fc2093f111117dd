//! `body.initial_stress`: components, or K0.

use crate::deck::expression::Expression;
use crate::deck::model::{InitialStress, K0};
use crate::deck::problems::Got;
use crate::deck::reader::Table;
use crate::deck::schema::{ANY, AXES, Range, at_least};

const COMPONENTS: [&str; 6] = ["xx", "yy", "zz", "xy", "yz", "xz"];
const OF_K0: [&str; 5] = ["unit_weight", "surface", "k0", "surcharge", "axis"];

pub fn read(table: &Table<'_>, dimension: usize) -> Got<InitialStress> {
    let any = |keys: &[&str]| keys.iter().any(|key| table.given(key));
    if any(&OF_K0) {
        table.refuse(&COMPONENTS, "K0 sets all components; leave one of them out")?;
        return k0(table, dimension);
    }
    if !any(&COMPONENTS) {
        let help = "for example { unit_weight = 18e3, surface = 10.0, k0 = 0.5 }";
        return Err(table.problem_with_help(
            "",
            "prescribes nothing: expected components or K0",
            help,
        ));
    }
    if dimension == 2 {
        table.refuse(&["yz", "xz"], "the problem is 2D")?;
    }
    let read = |key: &str| table.expression_if(key).map(|e| e.unwrap_or_else(zero));
    let [xx, yy, zz, xy, yz, xz] = COMPONENTS.map(read);
    Ok(InitialStress::Components(Box::new([xx?, yy?, zz?, xy?, yz?, xz?])))
}

fn zero() -> Expression {
    Expression::constant(0.0)
}

fn k0(table: &Table<'_>, dimension: usize) -> Got<InitialStress> {
    let needed = |key: &str, range: Range| {
        let value = table.number_or_expression(key, range)?;
        value.ok_or_else(|| table.missing(key, "K0 needs it"))
    };
    let (unit_weight, surface) = (needed("unit_weight", at_least(0.0)), needed("surface", ANY));
    let k0 = needed("k0", at_least(0.0));
    let surcharge = table.number_or_expression("surcharge", at_least(0.0));
    let axis = match table.given("axis") {
        true => table.choice_of("axis", &AXES[..dimension]),
        false => Ok(dimension - 1),
    };
    Ok(InitialStress::K0(Box::new(K0 {
        unit_weight: unit_weight?,
        surface: surface?,
        k0: k0?,
        surcharge: surcharge?,
        axis: axis?,
    })))
}
