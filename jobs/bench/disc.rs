//! One case of the study: writes the points and the deck, runs the program, reads its summary.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use mpm_par::analysis::solver::Linear;

const YOUNG: f64 = 1.0;
const POISSON: f64 = 0.3;
/// Points per cell and axis.
const PER_CELL: f64 = 2.0;

pub struct Case {
    pub dimension: usize,
    pub scaling: &'static str,
    /// Cells per radius of 1 m.
    pub cells: usize,
    pub place: usize,
    pub offset: [f64; 3],
    /// Four steps to strains of about 20 % instead of one to 1e-4.
    pub large: bool,
}

pub struct Outcome {
    pub points: usize,
    /// Linear iterations per solve.
    pub iterations: f64,
    pub evaluations: usize,
    /// Error of a normal stress over E times the amplitude: root mean square, and largest, which
    /// is found at the surface.
    pub stress_mean: f64,
    pub stress_largest: f64,
}

impl Case {
    pub fn name(&self) -> String {
        let deformation = if self.large { "large" } else { "small" };
        format!("{}d {} {deformation} {}", self.dimension, self.scaling, self.cells)
    }

    fn amplitude(&self) -> f64 {
        if self.large { 0.2 } else { 1e-4 }
    }

    /// `None`: the program did not solve it.
    pub fn run(&self) -> Option<Outcome> {
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("iterations");
        std::fs::create_dir_all(&folder).expect("the scratch folder can be made");
        std::fs::write(folder.join("points.csv"), self.points()).expect("points are written");
        let deck = folder.join("case.toml");
        std::fs::write(&deck, self.deck()).expect("the deck is written");
        let results = folder.join("results");
        let mut command = Command::new(env!("CARGO_BIN_EXE_mpm-par"));
        command.arg(&deck).arg("--out").arg(&results).arg("--force");
        for (name, value) in Linear::Multigrid.options(1, true) {
            command.arg(format!("-qs_{name}")).arg(value);
        }
        for name in ["OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "OMP_NUM_THREADS"]
        {
            command.env(name, "1");
        }
        let _ = std::fs::remove_file(results.join("summary.json"));
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        let ran = command.status().expect("the program starts");
        ran.success().then(|| self.read(&results.join("summary.json")))
    }

    fn read(&self, summary: &Path) -> Outcome {
        let text = std::fs::read_to_string(summary).expect("a finished run leaves a summary");
        let value: serde_json::Value = serde_json::from_str(&text).expect("the summary is JSON");
        let count = |at: &str| value.pointer(at).and_then(|v| v.as_u64()).unwrap_or(0) as usize;
        let number = |at: &str| value.pointer(at).and_then(|v| v.as_f64()).unwrap_or(f64::NAN);
        let evaluations = count("/newton_iterations/total");
        let solves = evaluations - count("/steps_completed");
        Outcome {
            points: count("/points"),
            iterations: count("/linear_iterations/total") as f64 / solves as f64,
            evaluations,
            stress_mean: number("/verify/stress_mean"),
            stress_largest: number("/verify/stress_largest"),
        }
    }

    fn spacing(&self) -> f64 {
        1.0 / self.cells as f64
    }

    /// A square lattice, turned about z by 0.5 and in space also about x by 0.3 radians.
    fn points(&self) -> String {
        let d = self.dimension;
        let s = self.spacing() / PER_CELL;
        let reach = (1.1 / s) as i64 * 2;
        let mut text = String::from(if d == 2 { "x,y,volume\n" } else { "x,y,z,volume\n" });
        let third = if d == 2 { 0..1 } else { -reach..reach };
        for k in third {
            for j in -reach..reach {
                for i in -reach..reach {
                    let at = |n: i64| (n as f64 + 0.5) * s;
                    let (x, y, z) = (at(i), at(j), if d == 2 { 0.0 } else { at(k) });
                    let (sin, cos) = 0.3f64.sin_cos();
                    let (y, z) =
                        if d == 2 { (y, z) } else { (cos * y - sin * z, sin * y + cos * z) };
                    let (sin, cos) = 0.5f64.sin_cos();
                    let (x, y) = (cos * x - sin * y, sin * x + cos * y);
                    if x * x + y * y + z * z < 1.0 {
                        let _ = match d {
                            2 => writeln!(text, "{x},{y},{}", s * s),
                            _ => writeln!(text, "{x},{y},{z},{}", s * s * s),
                        };
                    }
                }
            }
        }
        text
    }

    fn deck(&self) -> String {
        let d = self.dimension;
        let h = self.spacing();
        let a = self.amplitude();
        let lambda = YOUNG * POISSON / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON));
        let mu = YOUNG / (2.0 * (1.0 + POISSON));
        let n = d as f64;
        // No traction at r = 1; the body force that keeps the balance.
        let c = (n * lambda + 2.0 * mu) / ((n + 2.0) * lambda + 6.0 * mu);
        let force = a * c * ((2.0 * n + 4.0) * lambda + (4.0 * n + 8.0) * mu);
        let axes = &["X", "Y", "Z"][..d];
        let squares: Vec<String> = axes.iter().map(|x| format!("{x}*{x}")).collect();
        let r2 = format!("({})", squares.join("+"));
        let swell = |axis: &str| format!("{a}*(1-{c}*{r2})*{axis}");
        let stress = format!("{a}*({lambda}*({n}-{c}*({n}+2)*{r2})+2*{mu}*(1-{c}*{r2}-2*{c}*X*X))");
        let list =
            |value: &dyn Fn(usize) -> String| (0..d).map(value).collect::<Vec<_>>().join(", ");
        let pad = if self.large { 0.4 } else { 2.0 * h };
        let cells = ((2.0 + 2.0 * pad) / h).round() as usize;
        let origin = list(&|i| format!("{:?}", -1.0 - pad + self.offset[i] * h));
        let ghost = match self.scaling {
            "off" => "ghost = \"off\"\n".to_string(),
            name => format!("ghost = {{ stiffness_factor = 1.0, scaling = \"{name}\" }}\n"),
        };
        let cap = list(&|i| if i + 1 == d { "-0.7".into() } else { "3.0".to_string() });
        let verify: String = [("stress_mean", "volume-l2"), ("stress_largest", "max")]
            .map(|(name, norm)| {
                format!(
                    "[[verify]]\nname = \"{name}\"\nfield = \"stress.xx\"\nexact = \"{stress}\"\n\
                     norm = \"{norm}\"\nscale = {a}\n"
                )
            })
            .concat();
        format!(
            "title = \"{}\"\n{ghost}[analysis]\ntype = \"quasi-static\"\nsteps = {}\n\
             max_iterations = 20\n[method]\nbasis = \"gimp\"\n\
             [grid]\ntype = \"lattice\"\norigin = [{origin}]\ncells = {:?}\nh = {h}\n\
             [material.m]\nmodel = \"hencky\"\nyoung = {YOUNG:?}\npoisson = {POISSON}\n\
             [[body]]\nname = \"body\"\nmaterial = \"m\"\ndensity = 1.0\n\
             shape = {{ points = \"points.csv\" }}\n\
             [[boundary]]\nname = \"cap\"\nwhere = {{ box = {{ min = {:?}, max = [{cap}] }} }}\n\
             displacement = {{ {} }}\n\
             [[load]]\nbody_force = [{}]\n{verify}[output]\nevery = 1000\nfields = [\"stress\"]\n",
            self.name(),
            if self.large { 4 } else { 1 },
            vec![cells; d],
            vec![-3.0; d],
            list(&|i| format!("{} = \"{}\"", ["x", "y", "z"][i], swell(axes[i]))),
            list(&|i| format!("\"{force}*{}\"", axes[i])),
        )
    }
}
