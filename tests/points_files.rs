//! Points from files of other programs: csv with other names, VTK files as VTK, meshio and this program write
//! them, and what is said where a file does not fit.

mod common;

use std::fs;
use std::process::Command;

use common::run::{Outcome, Run};

/// `SHAPE` stands for what is beside points.
const DECK: &str = r#"
[analysis]
type = "explicit"
steps = 1
duration = 1e-6

[method]
basis = "gimp"
mass = "lumped"

[grid]
type = "lattice"
size = [4.0, 4.0]
h = 1.0

[material.soil]
model = "hencky"
young = 1e6
poisson = 0.3

[[body]]
name = "heap"
material = "soil"
density = 10.0
shape = SHAPE

[output]
fields = ["displacement", "velocity", "volume"]
"#;

fn run(folder: tempfile::TempDir, shape: &str, words: &[&str]) -> Outcome {
    let mut run = Run::text(&DECK.replace("SHAPE", shape)).word("--force");
    for word in words {
        run = run.word(*word);
    }
    run.attempt_in(folder)
}

/// (mass, momentum along x and y): of the volumes, and with the velocities.
fn sums(outcome: Outcome) -> [f64; 3] {
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    let results = outcome.results();
    let momentum = |axis: &str| results.history(&format!("momentum_{axis}"))[0];
    [results.number("bodies.heap.mass"), momentum("x"), momentum("y")]
}

#[track_caller]
fn are(found: [f64; 3], expected: [f64; 3]) {
    for (a, b) in found.into_iter().zip(expected) {
        assert!((a - b).abs() <= 1e-12 * b.abs().max(1.0), "{found:?} for {expected:?}");
    }
}

fn put(name: &str, content: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a scratch folder");
    fs::write(folder.path().join(name), content).expect("written");
    folder
}

/// As ParaView writes a table: other names, columns that nobody asks for, bodies by number.
const TABLE: &str = "\"Points:0\",\"Points:1\",\"Points:2\",vol,speed_x,speed_y,mat,junk\n\
    1.5,1.5,0,0.25,1,0,0,hello\n2.5,1.5,0,0.5,0,2,1,\n1.5,2.5,0,0.25,3,0,0,x\n";
const NAMES: &str = "names = { x = \"Points:0\", y = \"Points:1\", vx = \"speed_x\", vy = \"speed_y\", \
    volume = \"vol\", body = \"mat\" }";

#[test]
fn a_table_with_other_names_is_read() {
    let shape =
        |of_body: usize| format!("{{ points = \"cloud.csv\", of_body = {of_body}, {NAMES} }}");
    are(sums(run(put("cloud.csv", TABLE), &shape(0), &[])), [5.0, 10.0, 0.0]);
    are(sums(run(put("cloud.csv", TABLE), &shape(1), &[])), [5.0, 0.0, 10.0]);
}

/// The same points as text, by VTK's old format.
const LEGACY: &str = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 3 double\n1.5 1.5 0\n\
    2.5 1.5 0\n1.5 2.5 0\nPOINT_DATA 3\nSCALARS volume double\nLOOKUP_TABLE default\n0.25 0.5 0.25\n\
    VECTORS velocity double\n1 0 0\n0 2 0\n3 0 0\nFIELD more 1\nbody 1 3 int\n0 1 0\n";

#[test]
fn a_legacy_file_is_read() {
    for (of_body, expected) in [(0, [5.0, 10.0, 0.0]), (1, [5.0, 0.0, 10.0])] {
        let shape = format!("{{ points = \"cloud.vtk\", of_body = {of_body} }}");
        are(sums(run(put("cloud.vtk", LEGACY), &shape, &[])), expected);
    }
}

/// A frame of one run is the start of another: its points, places and velocities.
#[test]
fn a_frame_of_this_program_is_read() {
    let shape = format!("{{ points = \"cloud.csv\", of_body = 0, {NAMES} }}");
    let outcome = run(put("cloud.csv", TABLE), &shape, &["--set", "output.format=[\"vtu\"]"]);
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    let folder = outcome.folder;
    fs::copy(folder.path().join("out/points-000000.vtu"), folder.path().join("again.vtu")).unwrap();
    are(sums(run(folder, "{ points = \"again.vtu\" }", &[])), [5.0, 10.0, 0.0]);
}

/// Files as VTK's own writers and meshio write them: text, base64 and raw, with zlib and without.
#[test]
fn files_of_vtk_and_meshio_are_read() {
    let python = std::env::var("MPM_PAR_PYTHON").unwrap_or_else(|_| "python3".into());
    for (module, script, names) in [
        (
            "vtk",
            "import vtk, sys\n\
             grid = vtk.vtkUnstructuredGrid()\n\
             points = vtk.vtkPoints(); points.SetDataTypeToDouble()\n\
             [points.InsertNextPoint(*x) for x in ((1.5, 1.5, 0), (2.5, 1.5, 0), (1.5, 2.5, 0))]\n\
             grid.SetPoints(points)\n\
             for name, rows, kind in (('volume', [[.25], [.5], [.25]], vtk.vtkFloatArray), ('velocity', [[1, 0, 0], [0, 2, 0], [3, 0, 0]], vtk.vtkDoubleArray), ('body', [[0], [1], [0]], vtk.vtkIntArray)):\n    \
                 array = kind(); array.SetName(name); array.SetNumberOfComponents(len(rows[0]))\n    \
                 [array.InsertNextTuple(row) for row in rows]\n    \
                 grid.GetPointData().AddArray(array)\n\
             [grid.InsertNextCell(vtk.VTK_VERTEX, 1, [k]) for k in range(3)]\n\
             for mode in ('Ascii', 'Binary', 'Appended'):\n    \
                 for packed in (0, 1):\n        \
                     for raw in (0, 1):\n            \
                         writer = vtk.vtkXMLUnstructuredGridWriter()\n            \
                         writer.SetFileName('%s%d%d.vtu' % (mode, packed, raw))\n            \
                         getattr(writer, 'SetDataModeTo' + mode)()\n            \
                         writer.SetCompressorTypeToZLib() if packed else writer.SetCompressorTypeToNone()\n            \
                         writer.SetEncodeAppendedData(1 - raw)\n            \
                         writer.SetHeaderTypeToUInt64() if raw else writer.SetHeaderTypeToUInt32()\n            \
                         writer.SetInputData(grid); writer.Write()\n\
             for binary in (0, 1):\n    \
                 writer = vtk.vtkUnstructuredGridWriter()\n    \
                 writer.SetFileName('legacy%d.vtk' % binary)\n    \
                 writer.SetFileTypeToBinary() if binary else writer.SetFileTypeToASCII()\n    \
                 writer.SetInputData(grid); writer.Write()\n",
            &[
                "Ascii00.vtu",
                "Binary00.vtu",
                "Binary10.vtu",
                "Appended00.vtu",
                "Appended01.vtu",
                "Appended10.vtu",
                "Appended11.vtu",
                "legacy0.vtk",
                "legacy1.vtk",
            ][..],
        ),
        (
            "meshio",
            "import meshio, numpy as np\n\
             data = {'volume': np.array([.25, .5, .25]), 'velocity': np.array([[1., 0, 0], [0, 2, 0], [3, 0, 0]]), 'body': np.array([0, 1, 0])}\n\
             mesh = meshio.Mesh(np.array([[1.5, 1.5, 0], [2.5, 1.5, 0], [1.5, 2.5, 0]]), [('vertex', np.arange(3).reshape(3, 1))], point_data=data)\n\
             meshio.write('packed.vtu', mesh)\n\
             meshio.vtu.write('text.vtu', mesh, binary=False)\n\
             meshio.vtu.write('plain.vtu', mesh, compression=None)\n\
             meshio.write('meshio.vtk', mesh)\n",
            &["packed.vtu", "text.vtu", "plain.vtu", "meshio.vtk"],
        ),
    ] {
        let folder = tempfile::tempdir().expect("a scratch folder");
        let there = Command::new(&python).args(["-c", &format!("import {module}")]).output();
        if !there.is_ok_and(|output| output.status.success()) {
            println!("not run: {python} has no {module}");
            continue;
        }
        let made = Command::new(&python).args(["-c", script]).current_dir(folder.path()).output();
        let made = made.expect("it has just run");
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
        for name in names {
            let own = tempfile::tempdir().expect("a scratch folder");
            fs::copy(folder.path().join(name), own.path().join(name)).expect(name);
            let shape = format!("{{ points = \"{name}\", of_body = 0 }}");
            println!("{name}");
            are(sums(run(own, &shape, &[])), [5.0, 10.0, 0.0]);
        }
    }
}

#[track_caller]
fn refused(name: &str, content: &str, shape: &str, parts: &[&str]) {
    let outcome = run(put(name, content), shape, &["--check"]);
    let said = outcome.said();
    assert_eq!(outcome.code, 2, "{said}");
    assert!(parts.iter().all(|part| said.contains(part)), "{parts:?} not in\n{said}");
    assert!(!outcome.files().iter().any(|file| file.starts_with("out")), "{:?}", outcome.files());
}

#[test]
fn what_does_not_fit_is_said_before_anything_is_written() {
    let vtk = "{ points = \"cloud.vtk\" }";
    refused("cloud.vtk", LEGACY, vtk, &["error: cloud.vtk:", "bodies 0, 1", "of_body"]);
    let seven = "{ points = \"cloud.vtk\", of_body = 7 }";
    refused("cloud.vtk", LEGACY, seven, &["no points of body 7, only of 0, 1"]);
    let other = LEGACY.replace("volume", "MP_VOLUME");
    refused("cloud.vtk", &other, vtk, &["no array \"volume\"", "MP_VOLUME", "names = { volume"]);
    let wrong = "{ points = \"cloud.vtk\", of_body = 0, names = { volume = \"MP_VOLUM\" } }";
    refused("cloud.vtk", &other, wrong, &["names.volume", "did you mean \"MP_VOLUME\""]);
    let large = LEGACY.replace("0.25 0.5", "4.0 0.5");
    let first = "{ points = \"cloud.vtk\", of_body = 0 }";
    refused("cloud.vtk", &large, first, &["cloud.vtk: point 0: volume 4", "cell size 1 m"]);
    let twice = LEGACY.replace("1.5 2.5 0\nPOINT", "1.5 1.5 0\nPOINT");
    refused("cloud.vtk", &twice, first, &["point 2: a second point", "that of point 0"]);
    let high = LEGACY.replace("1.5 2.5 0\n", "1.5 2.5 1\n");
    refused("cloud.vtk", &high, first, &["the problem is 2D, but z goes from 0 to 1 m"]);
    refused("cloud.vtk", "x,y,volume\n", vtk, &["no VTK file"]);
    refused("cloud.vtu", "x,y,volume\n", "{ points = \"cloud.vtu\" }", &["no VTK XML file"]);
    let name = "{ points = \"cloud.vtk\", names = { x = \"a\" } }";
    refused("cloud.vtk", LEGACY, name, &["body.0.shape.names", "x: a VTK file has its places"]);
    let table =
        "{ points = \"cloud.csv\", of_body = 1, names = { volume = \"vol\", x = \"Points\" } }";
    refused("cloud.csv", TABLE, table, &["cloud.csv:1: no column \"Points\""]);
    let alone = "{ box = { min = [0, 0], max = [1, 1] }, of_body = 1 }";
    refused("cloud.csv", TABLE, alone, &["only beside points"]);
}
