//! What other programs and textbooks call the keys and words of the deck.
//!
//! A deck that is written from memory of another program has names such as `nu`, `phi` or `dt`, which no
//! distance between words leads to the names here.

/// The name here, and the names elsewhere: small letters, without `_` and `-`.
const KEYS: [(&str, &[&str]); 27] = [
    ("young", &["e", "youngsmodulus", "youngmodulus", "elasticmodulus", "modulus", "emod"]),
    ("poisson", &["nu", "poissonratio", "poissonsratio"]),
    ("friction", &["phi", "frictionangle", "internalfriction", "mu", "frictioncoefficient"]),
    ("dilation", &["psi", "dilatancy", "dilatancyangle", "dilationangle"]),
    ("cohesion", &["c", "coh"]),
    ("shear_strength", &["cu", "su", "undrainedshearstrength", "undrainedstrength"]),
    ("yield_stress", &["sigmay", "sigy", "fy", "yieldstrength"]),
    ("compression", &["lambda"]),
    ("swelling", &["kappa"]),
    ("slope", &["m", "csl"]),
    ("preconsolidation", &["pc", "pc0", "p0"]),
    ("model", &["type", "law", "constitutivelaw", "constitutivemodel", "materialmodel"]),
    ("density", &["rho", "massdensity"]),
    ("unit_weight", &["gamma"]),
    ("steps", &["nsteps", "numsteps", "loadsteps", "increments", "nincr", "lstps"]),
    ("duration", &["endtime", "tend", "totaltime", "tmax", "finaltime", "time"]),
    ("cfl", &["courant", "courantnumber"]),
    ("tolerance", &["tol"]),
    ("max_iterations", &["maxiter", "maxit", "iterations", "nrit", "nritmax"]),
    ("h", &["cellsize", "dx", "elementsize", "meshsize", "gridsize", "resolution"]),
    ("cells", &["nx", "ncells", "nels", "nelsx"]),
    (
        "points_per_cell",
        &["ppc", "mpc", "particlesperelement", "pointsperelement", "materialpointspercell"],
    ),
    ("fix", &["bc", "fixed", "fixity", "constraint", "constrained", "dof"]),
    ("displacement", &["disp", "u", "prescribeddisplacement"]),
    ("velocity", &["vel", "v", "v0", "initialvelocity"]),
    ("gravity", &["g", "gravityacceleration"]),
    ("every", &["interval", "frequency", "outputinterval"]),
];

const WORDS: [(&str, &[&str]); 25] = [
    ("hencky", &["linearelastic", "elastic", "linear", "stvenantkirchhoff"]),
    ("neo-hookean", &["hyperelastic"]),
    ("von-mises", &["mises", "j2", "elastoplastic"]),
    ("mohr-coulomb", &["mc"]),
    ("drucker-prager", &["dp"]),
    ("cam-clay", &["mcc", "modifiedcamclay"]),
    ("quasi-static", &["static", "implicit", "implicitstatic"]),
    ("explicit", &["dynamic", "explicitdynamic", "transient"]),
    ("implicit-dynamic", &["newmark"]),
    ("plane-strain", &["2d", "plane"]),
    ("bottom", &["base", "floor", "ground", "lower", "south"]),
    ("top", &["roof", "upper", "surface", "north"]),
    ("left", &["west"]),
    ("right", &["east"]),
    ("mpm", &["bilinear", "standard"]),
    ("gimp", &["ugimp", "cgimp", "gimpm"]),
    ("cpdi1", &["cpdi"]),
    ("displacement", &["u", "disp"]),
    ("velocity", &["v", "vel"]),
    ("stress", &["sigma", "cauchystress"]),
    ("log_strain", &["strain", "epsilon", "eps", "strains"]),
    ("von_mises", &["mises", "sigmaeq", "equivalentstress"]),
    ("plastic_strain", &["peeq", "eqps", "epspl"]),
    ("pore_pressure", &["pwp", "pw", "porewaterpressure"]),
    ("deformation_gradient", &["f"]),
];

/// The one of `known` that is meant by another program's name of a key.
pub fn key<'n>(name: &str, known: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    found(&KEYS, name, known)
}

/// The one of `known` that is meant by another program's word for a value.
pub fn word<'n>(name: &str, known: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    found(&WORDS, name, known)
}

/// Small letters, without `_`, `-` and blanks.
pub fn plain(name: &str) -> String {
    name.to_lowercase().replace(['_', '-', ' '], "")
}

fn found<'n>(
    table: &[(&str, &[&str])],
    name: &str,
    known: impl IntoIterator<Item = &'n str>,
) -> Option<&'n str> {
    let plain = plain(name);
    let mut known = known.into_iter();
    known.find(|here| {
        let is_meant = |(own, others): &(&str, &[&str])| {
            own == here
                && (others.contains(&plain.as_str()) || here.replace(['_', '-'], "") == plain)
        };
        *here != name && table.iter().any(is_meant)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deck::schema;

    #[test]
    fn names_of_other_programs_lead_to_those_here() {
        let known = ["friction", "young", "poisson"];
        assert_eq!(key("phi", known), Some("friction"));
        assert_eq!(key("Youngs_Modulus", known), Some("young"));
        assert_eq!(key("E", known), Some("young"));
        assert_eq!(key("zeta", known), None);
        assert_eq!(word("MohrCoulomb", ["hencky", "mohr-coulomb"]), Some("mohr-coulomb"));
        assert_eq!(word("strain", ["stress"]), None);
    }

    #[test]
    fn every_name_of_the_table_is_a_key_of_the_deck() {
        for (here, others) in KEYS {
            assert!(schema::sections().any(|section| section.key(here).is_some()), "{here}");
            for other in others {
                assert_eq!(*other, other.to_lowercase().replace(['_', '-', ' '], ""));
            }
        }
    }
}
