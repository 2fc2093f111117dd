//! Frames read by software that is not written here: VTK, meshio, h5py.
//!
//! `MPM_PAR_PYTHON` names a Python that has them, if `python3` has not.

mod common;

use std::path::Path;
use std::process::Command;

use common::run::Run;
use mpm_par::deck::templates::template_of;

fn python_name() -> String {
    std::env::var("MPM_PAR_PYTHON").unwrap_or_else(|_| "python3".into())
}

/// Runs the script, which has the results' directory in `folder`, where Python has the modules.
fn read_by(modules: &str, script: &str, folder: &Path) -> bool {
    let there = Command::new(python_name()).args(["-c", &format!("import {modules}")]).output();
    if !there.is_ok_and(|output| output.status.success()) {
        println!("not run: {} has no {modules}", python_name());
        return false;
    }
    let script =
        format!("import sys, numpy as np, {modules}\nfolder = sys.argv[1] + '/'\n{script}");
    let output = Command::new(python_name()).args(["-c", &script]).arg(folder).output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{modules}: {text}");
    true
}

fn beam() -> Run {
    let run = Run::text(template_of("beam").unwrap().text).set("analysis.steps=4");
    let run = run.set("load.0.point.force=[0, -20e3]").set("output.checkpoint={every=2}");
    run.set("output.format=[\"xdmf\", \"vtu\", \"vtkhdf\"]")
}

#[test]
fn other_readers_open_the_frames() {
    let results = beam().ranks(3).results();
    let folder = &results.directory;
    read_by(
        "h5py",
        "file = h5py.File(folder + 'points-000004.h5')\n\
         unit = lambda name: file[name].attrs['unit']\n\
         text = lambda value: value.decode() if isinstance(value, bytes) else value\n\
         assert text(unit('stress')) == 'Pa' and text(unit('displacement')) == 'm'\n\
         assert 'Cauchy' in text(file['stress'].attrs['description'])\n\
         assert file['id'][:].min() >= 0 and len(set(file['id'][:])) == 360\n",
        folder,
    );
    let same = "import h5py\n\
         file = h5py.File(folder + 'points-000004.h5')\n\
         for name in ('displacement', 'stress', 'von_mises', 'id', 'rank'):\n    \
             assert np.array_equal(get(name), file[name][:]), name\n\
         assert np.array_equal(places, file['position'][:])\n";
    read_by(
        "meshio, h5py",
        &format!(
            "mesh = meshio.read(folder + 'points-000004.vtu')\n\
             get = lambda name: mesh.point_data[name].reshape(360, -1).squeeze()\n\
             places = mesh.points\n\
             assert mesh.cells[0].type == 'vertex' and len(mesh.cells[0].data) == 360\n{same}"
        ),
        folder,
    );
    for (reader, file) in [("vtkXMLUnstructuredGridReader", "vtu"), ("vtkHDFReader", "h5")] {
        read_by(
            "vtk, h5py",
            &format!(
                "from vtk.util.numpy_support import vtk_to_numpy\n\
                 reader = vtk.{reader}()\n\
                 reader.SetFileName(folder + 'points-000004.{file}')\n\
                 reader.Update()\n\
                 grid = reader.GetOutput()\n\
                 assert grid.GetNumberOfCells() == 360 and grid.GetCellType(7) == vtk.VTK_VERTEX\n\
                 get = lambda name: vtk_to_numpy(grid.GetPointData().GetArray(name))\n\
                 places = vtk_to_numpy(grid.GetPoints().GetData())\n{same}"
            ),
            folder,
        );
    }
    let text = results.text("points.pvd");
    assert_eq!(text.matches("<DataSet").count(), 3);
    assert!(text.contains("timestep=\"1e0\" part=\"0\" file=\"points-000004.vtu\""));
    let list: serde_json::Value =
        serde_json::from_str(&results.text("points.vtkhdf.series")).unwrap();
    assert_eq!(list["files"].as_array().unwrap().len(), 3);
    assert_eq!(list["files"][2]["name"], "points-000004.h5");
}

/// A restart goes on with all lists; other formats are no other problem, and --force removes all.
#[test]
fn lists_go_on_after_a_restart() {
    let whole = beam().ranks(2).results();
    let lists = |results: &common::run::Results| {
        ["points.pvd", "points.vtkhdf.series", "points.xdmf"].map(|name| results.text(name))
    };
    let before = lists(&whole);
    let checkpoint = whole.directory.join("checkpoint-000002.h5").display().to_string();
    let folder = whole.into_folder();
    let again = beam().ranks(2).word("--restart").word(checkpoint).attempt_in(folder);
    assert_eq!(again.code, 0, "{}", again.stderr);
    let results = again.results();
    assert_eq!(lists(&results), before);
    let names = |folder: &Path| {
        let entries = std::fs::read_dir(folder).unwrap();
        let mut names: Vec<String> =
            entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    };
    assert!(!names(&results.directory).iter().any(|name| name.contains(".superseded")));
    let plain = beam().word("--force").set("output.format=[\"vtu\"]");
    let outcome = plain.attempt_in(results.into_folder());
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    let left = names(&outcome.folder.path().join("out"));
    let has = |name: &str| left.iter().any(|own| own == name);
    assert!(has("points.pvd") && has("points-000002.vtu") && has("points-000002.h5"), "{left:?}");
    assert!(!has("points.xdmf") && !has("points.vtkhdf.series") && !has("grid.xdmf"), "{left:?}");
}
