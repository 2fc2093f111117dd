//! The Python package of `jobs/python`: it reads what a run has written, and runs sweeps.
//!
//! `MPM_PAR_PYTHON` names a Python that has h5py and numpy, if `python3` has not.

mod common;

use std::path::Path;
use std::process::{Command, Output};

use common::run::Run;
use mpm_par::deck::templates::template_of;

fn python_name() -> String {
    std::env::var("MPM_PAR_PYTHON").unwrap_or_else(|_| "python3".into())
}

fn package() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("jobs/python")
}

fn python(words: &[&str], folder: &Path) -> Output {
    let template = common::job(1, 600);
    let mut python = Command::new(python_name());
    for (name, value) in template.get_envs() {
        if let Some(value) = value {
            python.env(name, value);
        }
    }
    // Nothing is left in the source tree.
    python.env("PYTHONDONTWRITEBYTECODE", "1").env("PYTHONPATH", package());
    python.args(words).current_dir(folder).output().expect("Python starts")
}

fn has(modules: &str) -> bool {
    let found = Command::new(python_name()).args(["-c", &format!("import {modules}")]).output();
    found.is_ok_and(|output| output.status.success())
}

#[track_caller]
fn good(output: &Output) -> String {
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{text}\n{}", String::from_utf8_lossy(&output.stderr));
    text
}

fn beam() -> Run {
    let run = Run::text(template_of("beam").unwrap().text).set("analysis.steps=4");
    run.set("load.0.point.force=[0, -20e3]")
}

#[test]
fn the_package_reads_what_a_run_has_written() {
    if !has("h5py, numpy") {
        println!("not run: {} has no h5py and numpy", python_name());
        return;
    }
    let results = beam().ranks(2).results();
    let script = "import mpm_par, sys, numpy as np\n\
        run = mpm_par.open(sys.argv[1])\n\
        assert run.status == 'completed' and run.steps == [0, 2, 4], run.steps\n\
        frame = run.points(-1)\n\
        assert list(frame.id) == sorted(frame.id) and frame['stress'].shape == (360, 6)\n\
        assert frame.unit('stress.yy') == 'Pa', frame.units\n\
        length = frame.component('|displacement|')\n\
        assert np.allclose(length, np.linalg.norm(frame['displacement'], axis=1))\n\
        x, values = run.section([0, 9.5], [10, 9.5], 'stress.xx', step=0)\n\
        assert len(x) >= 60 and np.all(np.diff(x) >= 0) and np.all(values == 0)\n\
        for call in (lambda: run.points(3), lambda: frame.component('stress.yx'), lambda: run.history['x']):\n    \
            try:\n        \
                call(); raise SystemExit('nothing was refused')\n    \
            except KeyError:\n        \
                pass\n\
        history = run.history\n\
        print(repr(float(frame.component('stress.yy').sum())), repr(float(history['energy_strain'][-1])),\n      \
            history.units['energy_strain'], len(history), run.probes['tip.displacement.y'][-1])\n";
    let directory = results.directory.display().to_string();
    let said = good(&python(&["-c", script, &directory], results.directory.as_path()));
    let words: Vec<&str> = said.split_whitespace().collect();
    let number = |k: usize| words[k].parse::<f64>().expect("a number");
    let sum: f64 = results.points(4).component("stress", 3).iter().sum();
    let size: f64 = results.points(4).component("stress", 3).iter().map(|s| s.abs()).sum();
    assert!((number(0) - sum).abs() <= 1e-12 * size, "{said} {sum}");
    assert_eq!(number(1), results.history("energy_strain")[3]);
    assert_eq!(words[2..4], ["J/m", "4"]);
    if has("matplotlib") {
        let script =
            "import mpm_par, sys; mpm_par.open(sys.argv[1]).plot('stress.xx', save='a.png')";
        good(&python(&["-c", script, &directory], results.directory.as_path()));
        let picture = |name: &str| {
            let bytes = std::fs::read(results.directory.join(name)).expect("a picture");
            assert!(bytes.starts_with(b"\x89PNG") && bytes.len() > 10_000, "{name}");
            bytes
        };
        let script = "import mpm_par, sys\n\
            mpm_par.open(sys.argv[1]).plot('stress.xx', save='b.png', domains=True)";
        good(&python(&["-c", script, &directory], results.directory.as_path()));
        assert_ne!(picture("a.png"), picture("b.png"));
    } else {
        println!("plot: not run: {} has no matplotlib", python_name());
    }
    if has("pyvista") {
        // The domains of 360 points fill the beam of 10 m2, but for what it stretches.
        let script = "import mpm_par, sys, numpy as np\n\
            frame = mpm_par.open(sys.argv[1]).points(-1)\n\
            cloud, domains = frame.cloud(), frame.domains()\n\
            assert cloud.n_points == domains.n_cells == 360\n\
            assert np.array_equal(cloud.point_data['stress'], frame['stress'])\n\
            areas = domains.compute_cell_sizes(length=False, volume=False).cell_data['Area']\n\
            assert abs(areas.sum() - 10) < 0.2, areas.sum()\n\
            assert np.abs(domains.cell_centers().points - frame.position).max() < 1e-6";
        good(&python(&["-c", script, &directory], results.directory.as_path()));
    } else {
        println!("cloud: not run: {} has no pyvista", python_name());
    }
}

#[test]
fn a_sweep_runs_each_setting_once() {
    if !has("h5py, numpy") {
        println!("not run: {} has no h5py and numpy", python_name());
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("beam.toml"), template_of("beam").unwrap().text).unwrap();
    let script = "import mpm_par, sys, os\n\
        keys = {'analysis.steps': [2, 3], 'material.rubber.young': [24e6]}\n\
        words = ['--set', 'load.0.point.force=[0, -20e3]']\n\
        go = lambda: mpm_par.sweep('beam.toml', keys, program=sys.argv[1], ranks=2, words=words)\n\
        table = go()\n\
        assert [settings['analysis.steps'] for settings, _ in table] == [2, 3]\n\
        assert [len(run.history) for _, run in table] == [2, 3]\n\
        assert all('young = 24000000' in run.deck for _, run in table)\n\
        before = [os.path.getmtime(run.directory + '/summary.json') for _, run in table]\n\
        assert before == [os.path.getmtime(run.directory + '/summary.json') for _, run in go()]\n\
        try:\n    \
            mpm_par.sweep('beam.toml', {'analysis.step': [2]}, program=sys.argv[1])\n    \
            raise SystemExit('nothing was refused')\n\
        except RuntimeError as error:\n    \
            assert 'did you mean' in str(error), error\n";
    good(&python(&["-c", script, env!("CARGO_BIN_EXE_mpm-par")], folder.path()));
}

/// The wheel, in a virtual environment of its own.
#[test]
#[ignore = "installs numpy and h5py from PyPI, half a minute"]
fn the_wheel_installs() {
    let folder = tempfile::tempdir().unwrap();
    let run = |words: &[&str]| {
        let output = Command::new(words[0]).args(&words[1..]).current_dir(folder.path()).output();
        good(&output.expect("it starts"));
    };
    let source = package();
    run(&["cp", "-r", &source.display().to_string(), "source"]);
    run(&[&python_name(), "-m", "venv", "venv"]);
    run(&["venv/bin/pip", "-q", "wheel", "--no-deps", "-w", "wheels", "./source"]);
    let wheel = std::fs::read_dir(folder.path().join("wheels")).unwrap().next().unwrap().unwrap();
    run(&["venv/bin/pip", "-q", "install", &wheel.path().display().to_string()]);
    let results = beam().results();
    let script = format!(
        "import mpm_par; run = mpm_par.open({:?}); assert len(run.points(4)) == 360, run.steps",
        results.directory.display().to_string()
    );
    run(&["venv/bin/python", "-c", &script]);
}
