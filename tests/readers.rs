//! Frames read by software that is not written here: VTK, meshio, h5py, pyvista, ParaView.
//!
//! `MPM_PAR_PYTHON` names a Python that has them, if `python3` has not; `MPM_PAR_PVPYTHON` is ParaView's.

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
    // Domains have the data of their points, and four corners each; the grid has nodes and cells.
    let same = "import h5py\n\
         points = h5py.File(folder + 'points-000004.h5')\n\
         grid = h5py.File(folder + 'grid-000004.h5')\n\
         for name in ('stress', 'id', 'von_mises'):\n    \
             assert np.array_equal(get('domains', 1, name), points[name][:]), name\n\
         for at, name in ((0, 'reaction'), (1, 'cell_rank'), (1, 'ghost_boundary'), (0, 'node_rank')):\n    \
             assert np.array_equal(get('grid', at, name), grid[name][:]), name\n\
         assert np.array_equal(places('domains'), points['domain_corners'][:])\n\
         assert np.array_equal(places('grid'), grid['coordinates'][:])\n\
         assert np.array_equal(corners('domains'), np.arange(1440).reshape(360, 4))\n\
         assert np.array_equal(corners('grid'), grid['connectivity'][:])\n";
    read_by(
        "meshio, h5py",
        &format!(
            "read = {{name: meshio.read(folder + name + '-000004.vtu') for name in ('domains', 'grid')}}\n\
             def get(name, at, field):\n    \
                 mesh = read[name]\n    \
                 return (mesh.cell_data[field][0] if at else mesh.point_data[field]).squeeze()\n\
             places = lambda name: read[name].points\n\
             corners = lambda name: read[name].cells[0].data\n\
             assert all(mesh.cells[0].type == 'quad' for mesh in read.values())\n{same}"
        ),
        folder,
    );
    for (reader, file) in [("vtkXMLUnstructuredGridReader", "vtu"), ("vtkHDFReader", "h5")] {
        read_by(
            "vtk, h5py",
            &format!(
                "from vtk.util.numpy_support import vtk_to_numpy\n\
                 def opened(name):\n    \
                     reader = vtk.{reader}()\n    \
                     reader.SetFileName(folder + name + '-000004.{file}')\n    \
                     reader.Update()\n    \
                     return reader.GetOutput()\n\
                 read = {{name: opened(name) for name in ('domains', 'grid')}}\n\
                 def get(name, at, field):\n    \
                     data = read[name].GetCellData() if at else read[name].GetPointData()\n    \
                     return vtk_to_numpy(data.GetArray(field))\n\
                 places = lambda name: vtk_to_numpy(read[name].GetPoints().GetData())\n\
                 corners = lambda name: vtk_to_numpy(read[name].GetCells().GetConnectivityArray()).reshape(-1, 4)\n\
                 assert all(grid.GetCellType(3) == vtk.VTK_QUAD for grid in read.values())\n{same}"
            ),
            folder,
        );
    }
    read_by(
        "pyvista",
        "for name, cells in (('points', 360), ('domains', 360), ('grid', None)):\n    \
             reader = pyvista.get_reader(folder + name + '.pvd')\n    \
             assert np.allclose(reader.time_values[-2:], [0.5, 1]), reader.time_values\n    \
             reader.set_active_time_value(1.0)\n    \
             mesh = reader.read()[0]\n    \
             assert cells is None or mesh.n_cells == cells\n    \
             assert mesh.n_cells > 30 and np.isfinite(mesh.points).all()\n",
        folder,
    );
    // VTK's XDMF reader makes full tensors of symmetric ones.
    read_by(
        "pyvista, h5py",
        "for name, fields in (\n        \
             ('points', ('displacement', 'stress', 'von_mises', 'id')),\n        \
             ('domains', ('displacement', 'stress', 'von_mises', 'id')),\n        \
             ('grid', ('reaction', 'node_rank', 'cell_rank'))):\n    \
             own = h5py.File(folder + name.replace('domains', 'points') + '-000004.h5')\n    \
             series = pyvista.get_reader(folder + name + '.xdmf')\n    \
             assert np.allclose(series.time_values[-2:], [0.5, 1]), series.time_values\n    \
             series.set_active_time_value(1.0)\n    \
             hdf = pyvista.HDFReader(folder + name + '-000004.h5').read()\n    \
             for mesh in (series.read(), hdf):\n        \
                 for field in fields:\n            \
                     data = np.asarray(mesh[field])\n            \
                     if data.ndim == 2 and data.shape[1] == 9:\n                \
                         data = data[:, [0, 1, 2, 4, 5, 8]]\n            \
                     assert np.array_equal(data, own[field][:]), (name, field)\n",
        folder,
    );
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
        let both = ["points.pvd", "points.vtkhdf.series", "points.xdmf", "grid.pvd", "domains.pvd"];
        let names = both.into_iter().chain(["grid.vtkhdf.series", "domains.vtkhdf.series"]);
        names.map(|name| results.text(name)).collect::<Vec<String>>()
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
    assert!(has("grid.pvd") && has("grid-000002.vtu") && has("domains-000002.vtu"), "{left:?}");
    assert!(!has("domains-000002.h5") && !has("domains.vtkhdf.series"), "{left:?}");
    assert!(has("points.pvd") && has("points-000002.vtu") && has("points-000002.h5"), "{left:?}");
    assert!(!has("points.xdmf") && !has("points.vtkhdf.series") && !has("grid.xdmf"), "{left:?}");
}

/// A list that is gone is said to be, one that is cut short is refused, and one in a format that the deck no longer
/// asks for ends where the run goes on: later files are gone, or are no files of that format.
#[test]
fn lists_of_all_formats_are_cared_for_at_a_restart() {
    let whole = beam().results();
    let read = |name: &str| whole.text(name);
    let (pvd, series) = (read("points.pvd"), read("points.vtkhdf.series"));
    let folder = whole.into_folder();
    let out = folder.path().join("out");
    let go_on = |run: Run, folder| {
        let checkpoint = out.join("checkpoint-000002.h5").display().to_string();
        run.word("--restart").word(checkpoint).attempt_in(folder)
    };
    std::fs::write(out.join("points.pvd"), &pvd[..pvd.len() - 60]).unwrap();
    let refused = go_on(beam().ranks(2), folder);
    assert_eq!(refused.code, 3, "{}", refused.stderr);
    let why = "points.pvd is not a time series that this program wrote";
    assert!(refused.stderr.contains(why), "{}", refused.stderr);

    std::fs::remove_file(out.join("points.pvd")).unwrap();
    let again = go_on(beam().set("output.format=[\"vtu\"]"), refused.folder);
    assert_eq!(again.code, 0, "{}", again.stderr);
    let said = format!("{}{}", again.stdout, again.stderr);
    assert!(
        said.contains("points.pvd is not there: the series begins anew after step 2"),
        "{said}"
    );
    assert!(!said.contains("domains.pvd is not there"), "{said}");
    let text = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    assert_eq!(text("points.pvd").matches("<DataSet").count(), 1);
    assert_eq!(series.matches("points-").count(), 3);
    assert_eq!(text("points.vtkhdf.series").matches("points-").count(), 2);
    assert_eq!(text("points.xdmf").matches("<Grid Name=\"step ").count(), 2);
    assert_eq!(text("grid.xdmf").matches("<Grid Name=\"step ").count(), 1);
}

/// All series, by the reader that ParaView chooses for the file, and a picture of one.
#[test]
#[ignore = "needs ParaView: MPM_PAR_PVPYTHON names its pvpython"]
fn paraview_opens_all_series() {
    let Ok(pvpython) = std::env::var("MPM_PAR_PVPYTHON") else {
        // `make validate` runs on machines without ParaView, too.
        return eprintln!("not run: MPM_PAR_PVPYTHON is to name ParaView's pvpython");
    };
    let results = beam().ranks(3).results();
    let script = "\
import os, shutil, sys
from paraview.simple import *
folder = sys.argv[1] + '/'
ranges = {}
for name, field, cells, data in [
    ('points', 'von_mises', 360, 'PointData'), ('domains', 'von_mises', 360, 'CellData'), ('grid', 'reaction', None, 'PointData')
]:
    for ending in ('.xdmf', '.pvd', '.vtkhdf.series'):
        try:
            source = OpenDataFile(folder + name + ending)
        except RuntimeError:
            # Before 5.12 this is the ending that ParaView knows.
            shutil.copy(folder + name + ending, folder + name + '.hdf.series')
            source = OpenDataFile(folder + name + '.hdf.series')
        times = [float(t) for t in source.TimestepValues]
        assert times == ([0.5, 1.0] if name == 'grid' else [0.0, 0.5, 1.0]), (name, ending, times)
        source.UpdatePipeline(1.0)
        count = source.GetDataInformation().GetNumberOfCells()
        assert cells is None or count == cells, (name, ending, count)
        found = getattr(source, data).GetArray(field).GetRange(0)
        known = ranges.setdefault(name, (found, count))
        assert abs(found[1] - known[0][1]) <= 1e-6 * abs(known[0][1]) and count == known[1], (name, ending, found, known)
        print(name + ending, type(source).__name__, times, count, found)
        if name + ending == 'domains.xdmf' and 'DISPLAY' in os.environ:
            view = CreateView('RenderView')
            view.ViewSize = [600, 500]
            shown = Show(source, view)
            ColorBy(shown, ('CELLS', 'von_mises'))
            view.ViewTime = 1.0
            shown.RescaleTransferFunctionToDataRange()
            ResetCamera(view)
            SaveScreenshot(folder + 'paraview.png', view)
        Delete(source)
";
    let path = results.directory.join("open.py");
    std::fs::write(&path, script).unwrap();
    let output = Command::new(pvpython).arg(&path).arg(&results.directory).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let wrong = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}\n{wrong}");
    assert_eq!(said.lines().filter(|line| line.contains("0.5, 1.0]")).count(), 9, "{said}");
    println!("{said}");
    // Debian's ParaView draws on a screen only; one of Xvfb will do.
    if std::env::var_os("DISPLAY").is_some() {
        let picture = std::fs::read(results.directory.join("paraview.png")).expect("a picture");
        assert!(picture.starts_with(b"\x89PNG") && picture.len() > 5_000);
    } else {
        println!("no picture was made: DISPLAY is not set");
    }
}
