//! A deck in other units of length, mass and time gives the same digits: nothing in the program
//! has an absolute scale. The decks hold the physics that decides by thresholds: contact and its
//! active set, softening, caps, water, surfaces off the grid, bodies that move freely.
//!
//! Every number of these decks that has a dimension stands as `<number unit>`.
mod common;

use common::run::Run;

/// A system of units: how many of its metres, kilograms and seconds are one of SI, as powers of
/// two, so that numbers change by their exponents alone.
#[derive(Clone, Copy)]
struct Units {
    metre: i32,
    kilogram: i32,
    second: i32,
}

const SI: Units = Units { metre: 0, kilogram: 0, second: 0 };
/// Near to millimetre, tonne and second turned upside down, and a system of large units.
const OTHERS: [Units; 2] =
    [Units { metre: 10, kilogram: 20, second: 7 }, Units { metre: -13, kilogram: -31, second: -9 }];

impl Units {
    /// What one SI unit such as `kg/m3`, `N m` or `J/m2` amounts to. Panics for one it does not know.
    fn factor(self, unit: &str) -> f64 {
        let exponent = |word: &str| -> i32 {
            let digits = word.trim_start_matches(|c: char| !c.is_ascii_digit());
            let power = if digits.is_empty() { 1 } else { digits.parse().expect("a power") };
            let newton = self.kilogram + self.metre - 2 * self.second;
            power
                * match &word[..word.len() - digits.len()] {
                    "m" => self.metre,
                    "kg" => self.kilogram,
                    "s" => self.second,
                    "N" => newton,
                    "J" => newton + self.metre,
                    "Pa" => newton - 2 * self.metre,
                    "-" | "" => 0,
                    other => panic!("{other:?} in {unit:?} is no unit of this test"),
                }
        };
        let product = |words: &str| words.split_whitespace().map(exponent).sum::<i32>();
        let (above, below) = unit.split_once('/').unwrap_or((unit, "-"));
        2f64.powi(product(above) - product(below))
    }

    /// The deck with every `<number unit>` in these units.
    fn write(self, deck: &str) -> String {
        let mut parts = deck.split('<');
        let mut text = parts.next().unwrap_or_default().to_string();
        for part in parts {
            let (quantity, rest) = part.split_once('>').expect("a closed bracket");
            let (number, unit) = quantity.split_once(' ').expect("a number and its unit");
            let number: f64 = number.parse().expect("a number");
            text.push_str(&format!("{:?}{rest}", number * self.factor(unit)));
        }
        text
    }
}

/// Columns of history.csv that say how long the machine took.
const OF_THE_MACHINE: [&str; 3] = ["imbalance", "moved_points", "wall_seconds"];

/// Runs the deck in all systems and compares every column of the history.
fn assert_same_digits(deck: &str, rows: usize) {
    let histories = [SI, OTHERS[0], OTHERS[1]].map(|units| {
        let results = Run::text(&units.write(deck)).ranks(2).results();
        let text = results.text("history.csv");
        let header: Vec<String> =
            text.lines().next().unwrap().split(',').map(str::to_string).collect();
        let columns: Vec<Vec<f64>> = header
            .iter()
            .map(|title| {
                let (name, unit) = title.split_once(" [").expect("a name and a unit");
                let factor = units.factor(unit.trim_end_matches(']'));
                results.history(name).iter().map(|value| value / factor).collect()
            })
            .collect();
        (header, columns)
    });
    let [(header, si), others @ ..] = &histories;
    assert!(si[0].len() >= rows, "{} rows", si[0].len());
    for (units, (other_header, other)) in OTHERS.iter().zip(others) {
        assert_eq!(header, other_header);
        for ((title, ours), theirs) in header.iter().zip(si).zip(other) {
            if OF_THE_MACHINE.iter().any(|name| title.starts_with(name)) {
                continue;
            }
            assert_eq!(ours.len(), theirs.len(), "{title}");
            let scale = ours.iter().fold(0.0f64, |most, value| most.max(value.abs()));
            for (row, (a, b)) in ours.iter().zip(theirs).enumerate() {
                let (m, kg, s) = (units.metre, units.kilogram, units.second);
                assert!(
                    (a - b).abs() <= 1e-10 * scale,
                    "2^{m} m, 2^{kg} kg, 2^{s} s: {title}, row {row}: {a:e} and {b:e}"
                );
            }
        }
    }
}

#[test]
fn a_footing_on_softening_soil() {
    assert_same_digits(FOOTING, 4);
}

#[test]
fn a_free_ball_falls_on_clay_beside_rubber() {
    assert_same_digits(COLLISION, 100);
}

#[test]
fn a_block_on_surfaces_off_the_grid() {
    assert_same_digits(SURFACES, 2);
}

const FOOTING: &str = r#"
[analysis]
type = "quasi-static"
steps = 4
max_iterations = 30
on_failure = "cut"
[method]
basis = "gimp"
locking = "f-bar"
[grid]
type = "lattice"
size = [<4.0 m>, <3.0 m>]
h = <0.5 m>
[material.soil]
model = "mohr-coulomb"
young = "<20e6 Pa> + <1e6 Pa/m>*(<2 m>-Y)"
poisson = 0.3
cohesion = "<10e3 Pa> + <1e3 Pa/m>*(<2 m>-Y)"
friction = 25.0
dilation = 5.0
[material.soil.softening]
strain = 0.1
cohesion = <5e3 Pa>
friction = 20.0
dilation = 0.0
length = <0.5 m>
[[body]]
name = "soil"
material = "soil"
density = <1800.0 kg/m3>
shape = { box = { min = [0, 0], max = [<4 m>, <2 m>] } }
initial_stress = { unit_weight = <18e3 N/m3>, surface = <2.0 m>, k0 = 0.5 }
[[boundary]]
where = { side = "left" }
fix = ["x"]
[[boundary]]
where = { side = "right" }
fix = ["x"]
[[boundary]]
where = { side = "bottom" }
fix = ["y"]
[[load]]
gravity = [0, <-10 m/s2>]
[[rigid]]
name = "foot"
shape = { box = { min = [<1.6 m>, <2.0 m>], max = [<2.4 m>, <2.5 m>] } }
motion = { displacement = ["<0.005 m>*s", "<-0.03 m>*s"] }
[[contact]]
between = ["foot", "soil"]
friction = 0.3
adhesion = <1e3 Pa>
[water]
level = <1.0 m>
unit_weight = <10e3 N/m3>
[output]
every = 100
"#;

const COLLISION: &str = r#"
[analysis]
type = "explicit"
duration = <0.08 s>
cfl = 0.5
damping = { local = 0.1, mass = <0.5 1/s> }
[method]
basis = "gimp"
domain_update = "stretch"
mass = "consistent"
[grid]
type = "lattice"
origin = [<-1.0 m>, <-1.0 m>]
size = [<4.0 m>, <3.0 m>]
h = <0.125 m>
[material.clay]
model = "cam-clay"
young = <5e6 Pa>
poisson = 0.3
slope = 1.0
compression = 0.1
swelling = 0.02
preconsolidation = <50e3 Pa>
[material.rubber]
model = "neo-hookean"
young = <1e6 Pa>
poisson = 0.4
[[body]]
name = "clay"
material = "clay"
density = <1700.0 kg/m3>
shape = { disc = { centre = [<0.5 m>, <0.2 m>], radius = <0.4 m> } }
initial_stress = { xx = <-20e3 Pa>, yy = <-20e3 Pa>, zz = <-20e3 Pa> }
velocity = [<0.5 m/s>, <-1 m/s>]
[[body]]
name = "rubber"
material = "rubber"
density = <1100.0 kg/m3>
shape = { box = { min = [<1.5 m>, <-0.3 m>], max = [<2 m>, <0.3 m>] } }
velocity = [<-2 m/s>, 0]
[[rigid]]
name = "floor"
shape = { half_space = { point = [0, <-0.25 m>], normal = [0.1, 1] } }
[[rigid]]
name = "ball"
shape = { disc = { centre = [<0.5 m>, <0.9 m>], radius = <0.25 m> } }
density = <5000.0 kg/m3>
velocity = [<0.1 m/s>, <-3.0 m/s>]
[[contact]]
between = ["floor", "rubber"]
friction = 0.2
[[contact]]
between = ["floor", "clay"]
friction = "rough"
[[contact]]
between = ["ball", "clay"]
friction = 0.4
max_shear = <20e3 Pa>
[[load]]
gravity = [0, "<-10 m/s2>*min(1, t/<0.05 s>)"]
[[load]]
[load.pressure]
value = "<2e4 Pa>*sin(t/<0.01 s>)"
where = { box = { min = [<1.9 m>, <-0.4 m>], max = [<2.1 m>, <0.4 m>] } }
[output]
every = 100000
"#;

const SURFACES: &str = r#"
[analysis]
type = "quasi-static"
steps = 2
max_iterations = 20
[method]
basis = "gimp"
[grid]
type = "lattice"
origin = [<-0.5 m>, <-0.5 m>]
size = [<3.0 m>, <2.5 m>]
h = <0.25 m>
[material.soil]
model = "drucker-prager"
young = <10e6 Pa>
poisson = 0.25
friction = 30.0
dilation = 10.0
cohesion = <10e3 Pa>
fit = "plane-strain"
[[body]]
name = "block"
material = "soil"
density = <2000.0 kg/m3>
shape = { box = { min = [<0.1 m>, <0.07 m>], max = [<1.9 m>, <1.1 m>] } }
[[boundary]]
name = "floor"
surface = { body = "block", side = "bottom" }
slip = true
[[boundary]]
name = "wall"
surface = { body = "block", side = "left" }
fix = ["x"]
method = "nitsche"
[[load]]
gravity = [0, "<-10 m/s2>*s"]
[[load]]
traction = { body = "block", side = "top", value = ["<5e2 Pa>*s", "<-3e3 Pa>*s*(1 + X/<2 m>)"] }
[output]
every = 100
"#;
