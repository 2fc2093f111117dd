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

const LAME: &str = "Lamé's constants are told by young = mu (3 lambda + 2 mu) / (lambda + mu) and \
                    poisson = lambda / (2 (lambda + mu))";
const SHEAR_MODULUS: &str = "a shear modulus G is told by young = 2 G (1 + poisson) and poisson";
const NO_TIME: &str = "this analysis has no time: steps is the number of its load steps";
const STEP: &str = "a step is duration over steps, or follows from cfl in explicit runs";

/// What sets the time, or the time step, elsewhere.
const TIMES: [&str; 12] = [
    "time",
    "endtime",
    "tend",
    "totaltime",
    "tmax",
    "finaltime",
    "courant",
    "courantnumber",
    "dt",
    "timestep",
    "deltat",
    "stepsize",
];

/// What is known of another program's name in a table.
pub enum Meant {
    /// The cure.
    Hint(&'static str),
    /// Too many meanings: any hint would mislead.
    Unsaid,
    /// Nothing beyond the names of [`key`].
    Otherwise,
}

/// What a name means in a section where no single key has its meaning. `read`: the keys of the section that are
/// read there; `timeless`: it is that of an analysis of load steps.
pub fn meant(section: &str, name: &str, read: &[&str], timeless: bool) -> Meant {
    let small = plain(name);
    let reads = |key: &str| read.contains(&key);
    let told = match (section, small.as_str()) {
        ("contact", "phi" | "frictionangle" | "internalfriction") => {
            "friction is a coefficient here: friction = tan(phi)"
        }
        ("material", "g" | "shearmodulus" | "gmod") if reads("shear") => {
            "a shear modulus is called \"shear\" here"
        }
        ("material", "g" | "shearmodulus" | "gmod") => SHEAR_MODULUS,
        ("material", "lambda") if !reads("compression") => LAME,
        ("material", "mu") if !reads("friction") && !reads("compression") => LAME,
        // Lamé's constant, or a coefficient of friction.
        ("material", "mu") => return Meant::Unsaid,
        ("material", "c" | "coh" | "phi" | "frictionangle")
            if reads("shear_strength") && !reads("yield_stress") && !reads("friction") =>
        {
            "the strength of this model is shear_strength, without an angle of friction"
        }
        ("material" | "body", "gamma" | "unitweight") => {
            "weight is density of [[body]] times gravity of [[load]]"
        }
        ("boundary", "velocity" | "vel" | "v") => {
            "for a velocity v along x write displacement = { x = \"v*t\" }, with its value for v"
        }
        ("rigid", "u" | "disp" | "displacement") => "write motion = { displacement = [...] }",
        ("rigid", "v" | "vel") => "write motion = { velocity = [...] }",
        ("analysis", small) if timeless && TIMES.contains(&small) => NO_TIME,
        // Neither load steps nor time steps.
        ("analysis", small) if !reads("duration") && TIMES.contains(&small) => {
            return Meant::Unsaid;
        }
        (_, "dt" | "timestep" | "deltat" | "stepsize") => STEP,
        ("analysis", "courant" | "courantnumber") if !reads("cfl") => STEP,
        // Each table has a word of its own for what it is, and most have none.
        (_, _) if name == "type" && !reads("model") => return Meant::Unsaid,
        _ => return Meant::Otherwise,
    };
    Meant::Hint(told)
}

/// The one of `known` that is meant by another program's name of a key.
pub fn key<'n>(name: &str, known: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    // G is a shear modulus, and no key of its own.
    if name == "G" {
        return None;
    }
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
                assert_eq!(*other, plain(other));
            }
        }
    }
}
