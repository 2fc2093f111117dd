//! The files on 1 to 4 ranks, one of them empty: each test runs itself again under `mpirun`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use mpi::topology::{Communicator, SimpleCommunicator};

use super::agreement::{all_agree, on_root};
use super::directory::{Inputs, ResultsDirectory};
use super::extent;
use super::extent::body_summaries;
use super::series::frame_series::Series;
use super::series::grid_file::GridFrame;
use super::series::hdf5_reader::FileReader;
use super::series::hdf5_writer::FileWriter;
use super::series::points_file::PointsSeries;
use super::summary::Summary;
use super::tables::csv_table::Mark;
use super::tables::history::History;
use super::tables::history::{HistoryColumns, HistoryRow, Reaction};
use super::tables::residuals::Residuals;
use super::terminal::log::Log;
use crate::deck::fields::PointField;
use crate::deck::model::{Basis, Element, Format, Symmetry};
use crate::error::Error;
use crate::points::Points;

mod xdmf_reader;

use super::tests::xdmf_reader::read_xdmf;

const CASE: &str = "MPM_OUTPUT_CASE";
const FOLDER: &str = "MPM_OUTPUT_FOLDER";
const STEPS: [usize; 2] = [0, 5];

/// Runs `case` on `ranks` ranks in a fresh folder and returns the folder.
fn run(case: &str, ranks: usize) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new("mpirun")
        .args(["-n", &ranks.to_string(), "--timeout", "120"])
        .arg(std::env::current_exe().unwrap())
        .args(["output::tests::on_each_rank", "--exact", "--test-threads=1", "--nocapture"])
        .env(CASE, case)
        .env(FOLDER, folder.path())
        .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
        .env("OMPI_MCA_rmaps_base_oversubscribe", "1")
        .env("OMPI_MCA_hwloc_base_binding_policy", "none")
        .env("PRTE_MCA_rmaps_default_mapping_policy", ":oversubscribe")
        .env("PRTE_MCA_hwloc_default_binding_policy", "none")
        .env("OMPI_MCA_mpi_yield_when_idle", "1")
        .stdin(Stdio::null())
        .output()
        .expect("mpirun starts");
    let text = String::from_utf8_lossy(&output.stdout);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{case} on {ranks} ranks\n{text}\n{errors}");
    // A filter that matches nothing succeeds too.
    let ran = (0..ranks).filter(|rank| folder.path().join(format!("ran-{rank}")).exists()).count();
    assert_eq!(
        ran, ranks,
        "{text}
{errors}"
    );
    folder
}

/// Not a test by itself: what each rank does when a test above calls it.
#[test]
fn on_each_rank() {
    let Ok(case) = std::env::var(CASE) else { return };
    let folder = PathBuf::from(std::env::var(FOLDER).unwrap());
    std::panic::set_hook(Box::new(|info| {
        eprintln!("{info}");
        // SAFETY: ends all ranks; a panic on one would leave the others waiting for ever.
        unsafe { mpi::ffi::MPI_Abort(mpi::ffi::RSMPI_COMM_WORLD, 101) };
    }));
    let universe = mpi::initialize().unwrap();
    let comm = universe.world();
    match case.as_str() {
        "series-2d" => write_series::<2>(&folder, Basis::Cpdi1, &comm),
        "series-3d" => write_series::<3>(&folder, Basis::Gimp, &comm),
        "tables" => write_tables(&folder, &comm),
        "hdf5" => hdf5_round_trip(&folder, &comm),
        "errors" => errors_reach_every_rank(&folder, &comm),
        other => panic!("no case {other}"),
    }
    std::fs::write(folder.join(format!("ran-{}", comm.rank())), "").unwrap();
}

/// Points of a rank; the last of several ranks has none.
fn share_of_points<const D: usize>(comm: &SimpleCommunicator) -> Points<D> {
    let mut points = Points::default();
    let empty = comm.size() > 1 && comm.rank() == comm.size() - 1;
    for k in 0..if empty { 0 } else { 3 + comm.rank() as u64 } {
        let id = 100 * comm.rank() as u64 + k;
        let x = std::array::from_fn(|axis| id as f64 + 0.25 * axis as f64);
        points.push_unstrained(id, (k % 2) as u32, x, 0.04, 10.0, [0.1; D]);
        let last = points.len() - 1;
        points.position[last][0] += 0.5;
    }
    points
}

fn point_count(ranks: usize) -> usize {
    let filled = if ranks > 1 { ranks - 1 } else { 1 };
    (0..filled).map(|rank| 3 + rank).sum()
}

fn write_series<const D: usize>(folder: &Path, basis: Basis, comm: &SimpleCommunicator) {
    let directory =
        ResultsDirectory::create(&folder.join("out"), false, &Inputs::default(), comm).unwrap();
    let points = share_of_points::<D>(comm);
    let create = || PointsSeries::create(&directory, PointField::ALL, &[Format::Xdmf], (basis, D));
    let mut series = create();
    let mut grid = Series::create(&directory, ("grid", "grid"), &[Format::Xdmf]);
    // One cell on each rank with points, with its own nodes.
    let cells = usize::from(!points.is_empty());
    let nodes = cells << D;
    let first = (comm.rank() as usize) << D;
    let element = if D == 2 { Element::Quad4 } else { Element::Hex8 };
    let vectors = vec![[1.0; D]; nodes];
    let frame = GridFrame {
        element,
        coordinates: &vectors,
        connectivity: &(first..first + nodes).collect::<Vec<_>>(),
        displacement_increment: &vectors,
        reaction: &vectors,
        node_fields: &[("residual", &vec![0.5; nodes])],
        ghost_boundary: &vec![true; cells],
        cell_fields: &[("cost", &vec![2.0; cells])],
    };
    for step in STEPS {
        let when = (step, 0.1 * step as f64);
        series.write(when, &points, comm).unwrap();
        grid.write(when, &frame.shown(comm.rank()), comm).unwrap();
    }
    // A restart after step 0 forgets step 5 and writes it again.
    let mut series = create();
    series.resume(0, &mut Log::default(), comm).unwrap();
    series.cut(comm).unwrap();
    series.write((5, 0.5), &points, comm).unwrap();

    let bodies = body_summaries(&points, 3, (basis, Symmetry::PlaneStrain), comm);
    assert_eq!(bodies[0].min, std::array::from_fn::<_, D, _>(|axis| [0.5, 0.25, 0.5][axis]));
    assert!((bodies[0].extent_min[0] - 0.4).abs() < 1e-15);
    let total = point_count(comm.size() as usize) as f64;
    assert!((bodies[0].mass + bodies[1].mass - 0.4 * total).abs() < 1e-12);
    assert!(bodies[2].min.is_empty());
}

/// Every data item exists with the stated shape; returns the shapes by item name of the last grid.
fn check_xdmf(folder: &Path, name: &str, topology: &str) -> BTreeMap<String, Vec<usize>> {
    let grids = read_xdmf(&folder.join(name));
    assert_eq!(grids.len(), STEPS.len(), "{name}");
    let mut shapes = BTreeMap::new();
    for (grid, step) in grids.iter().zip(STEPS) {
        assert_eq!(grid.topology, topology);
        assert_eq!(grid.time.parse::<f64>().unwrap(), 0.1 * step as f64);
        for (item, dimensions, file, dataset) in &grid.items {
            assert!(file.ends_with(&format!("-{step:06}.h5")) && !file.contains('/'), "{file}");
            let stored = hdf5::File::open(folder.join(file)).unwrap().dataset(dataset).unwrap();
            assert_eq!(&stored.shape(), dimensions, "{name}: {item}");
            shapes.insert(item.clone(), dimensions.clone());
        }
    }
    shapes
}

fn check_series(case: &str, dimension: usize) {
    let (cell, per_cell) = if dimension == 2 { ("Quadrilateral", 4) } else { ("Hexahedron", 8) };
    for ranks in 1..=4 {
        let folder = run(case, ranks);
        let out = folder.path().join("out");
        let n = point_count(ranks);
        let shapes = check_xdmf(&out, "points.xdmf", "Polyvertex");
        assert_eq!(shapes["geometry"], [n, 3]);
        assert_eq!(shapes["stress"], [n, 6]);
        assert_eq!(shapes["deformation_gradient"], [n, 9]);
        assert_eq!(shapes["id"], [n]);
        assert_eq!(shapes.len(), PointField::ALL.len() + 2);
        let shapes = check_xdmf(&out, "domains.xdmf", cell);
        assert_eq!(shapes["topology"], [n, per_cell]);
        assert_eq!(shapes["geometry"], [n * per_cell, 3]);
        let shapes = check_xdmf(&out, "grid.xdmf", cell);
        let cells = ranks.max(2) - 1;
        assert_eq!(shapes["geometry"], [cells * per_cell, 3]);
        assert_eq!(shapes["topology"], [cells, per_cell]);
        assert_eq!(shapes["ghost_boundary"], [cells]);

        let file = hdf5::File::open(out.join("points-000005.h5")).unwrap();
        let ids = file.dataset("id").unwrap().read_raw::<i64>().unwrap();
        let positions = file.dataset("position").unwrap().read_raw::<f64>().unwrap();
        let displacements = file.dataset("displacement").unwrap().read_raw::<f64>().unwrap();
        let corners = file.dataset("domain_corners").unwrap().read_raw::<f64>().unwrap();
        let mut expected = Vec::new();
        for rank in 0..cells as i64 {
            expected.extend((0..3 + rank).map(|k| 100 * rank + k));
        }
        assert_eq!(ids, expected);
        for (p, &id) in ids.iter().enumerate() {
            assert_eq!(positions[3 * p], id as f64 + 0.5);
            let z = if dimension == 2 { 0.0 } else { id as f64 + 0.5 };
            assert_eq!(positions[3 * p + 2], z);
            assert_eq!(displacements[3 * p..3 * p + 3], [0.5, 0.0, 0.0]);
            assert!((corners[3 * per_cell * p] - (id as f64 + 0.4)).abs() < 1e-12);
        }
        let left: Vec<_> = std::fs::read_dir(&out)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .filter(|name| name.ends_with(".partial"))
            .collect();
        assert!(left.is_empty(), "{left:?}");
    }
}

#[test]
fn plane_strain_series_on_1_to_4_ranks() {
    check_series("series-2d", 2);
}

#[test]
fn solid_series_on_1_to_4_ranks() {
    check_series("series-3d", 3);
}

fn write_tables(folder: &Path, comm: &SimpleCommunicator) {
    let mut log = Log::new(comm);
    log.note("before the directory is known");
    let directory = ResultsDirectory::create(folder, false, &Inputs::default(), comm).unwrap();
    log.attach(&directory, false, comm).unwrap();
    log.note("after");
    directory.write_decks("title = 'a'\n", "title = \"a\"\n", comm).unwrap();
    let layout =
        || HistoryColumns { dimension: 2, boundaries: vec!["root".into()], ..Default::default() };
    let row = |step| HistoryRow {
        step,
        residual: 1.0 / 3.0,
        reactions: vec![Reaction { force: [1.5, 0.0, 0.0], ..Default::default() }],
        ..Default::default()
    };
    let mut history = History::create(&directory, layout()).unwrap();
    let mut residuals = Residuals::create(&directory).unwrap();
    on_root(comm, || {
        assert!(!folder.join("history.csv").exists(), "written before it was opened");
        Ok(())
    })
    .unwrap();
    assert_eq!(history.push(&row(1), comm).unwrap_err().exit_code(), 3);
    history.table.open(comm).unwrap();
    residuals.table.open(comm).unwrap();
    for step in 1..=4 {
        history.push(&row(step), comm).unwrap();
        residuals.push_step(step, &[1.0, 1e-10], comm).unwrap();
    }
    let mut history = History::create(&directory, layout()).unwrap();
    history.table.resume(Mark { rows: 2, step: 2 }, &mut log, comm).unwrap();
    let mut residuals = Residuals::create(&directory).unwrap();
    residuals.table.resume(Mark { rows: 4, step: 2 }, &mut log, comm).unwrap();
    history.table.open(comm).unwrap();
    residuals.table.open(comm).unwrap();
    history.push(&row(3), comm).unwrap();
    residuals.push_step(3, &[0.25], comm).unwrap();
    Summary { ranks: comm.size() as usize, ..Default::default() }.write(&directory, comm).unwrap();
    assert!(extent::peak_memory(comm).sum > 1 << 20);
}

#[test]
fn tables_survive_a_restart() {
    for ranks in [1, 3] {
        let folder = run("tables", ranks);
        let read = |name| std::fs::read_to_string(folder.path().join(name)).unwrap();
        assert_eq!(read("log.txt"), "before the directory is known\nafter\n");
        assert_eq!(read("input.toml"), "title = 'a'\n");
        assert_eq!(
            read("residuals.csv"),
            "step [-],iteration [-],residual [-]\n1,0,1\n1,1,1e-10\n2,0,1\n2,1,1e-10\n3,0,2.5e-1\n"
        );
        let mut table = csv::Reader::from_path(folder.path().join("history.csv")).unwrap();
        let header = table.headers().unwrap().clone();
        let column = |name| header.iter().position(|word| word == name).unwrap();
        let rows: Vec<_> = table.records().map(|row| row.unwrap()).collect();
        let number = |row: usize, name| rows[row][column(name)].parse::<f64>().unwrap();
        assert_eq!(rows.len(), 3);
        for (index, step) in [1.0, 2.0, 3.0].into_iter().enumerate() {
            assert_eq!(number(index, "step [-]"), step);
            assert_eq!(number(index, "residual [-]"), 1.0 / 3.0);
            assert_eq!(number(index, "reaction.root.x [N/m]"), 1.5);
        }
        let summary: serde_json::Value = serde_json::from_str(&read("summary.json")).unwrap();
        assert_eq!(summary["ranks"], ranks);
    }
}

fn hdf5_round_trip(folder: &Path, comm: &SimpleCommunicator) {
    let path = folder.join("table.h5");
    let rank = comm.rank() as u64;
    // Rank 0 holds nothing, to have the first rows come from another rank.
    let values: Vec<u64> = (0..2 * rank).map(|k| u64::MAX - (100 * rank + k)).collect();
    let file = FileWriter::create(&path, comm).unwrap();
    let total = file.write_rows("pairs", 2, &values).unwrap();
    assert_eq!(total as i32, comm.size() * (comm.size() - 1) / 2);
    file.write_rows::<f64>("nothing", 3, &[]).unwrap();
    file.write_number("version", &3_u32).unwrap();
    on_root(comm, || {
        assert!(!path.exists(), "the name appears with the whole file");
        Ok(())
    })
    .unwrap();
    file.finish().unwrap();

    let file = FileReader::open(&path, comm).unwrap();
    assert_eq!(file.shape("pairs").unwrap(), (total, 2));
    assert_eq!(file.shape("nothing").unwrap(), (0, 3));
    assert_eq!(file.read_number::<u32>("version").unwrap(), 3);
    let first = rank as usize * (rank as usize).saturating_sub(1) / 2;
    assert_eq!(file.read_rows::<u64>("pairs", first, rank as usize).unwrap(), values);
    assert!(file.read_all::<f64>("nothing").unwrap().is_empty());
    assert!(file.has("pairs") && !file.has("absent"));
    for error in [
        file.read_all::<f64>("absent").unwrap_err(),
        file.read_rows::<u64>("pairs", 0, if rank == 0 { total + 1 } else { 0 }).unwrap_err(),
        file.read_number::<f64>("absent").unwrap_err(),
    ] {
        assert_eq!(error.exit_code(), 3);
        assert!(error.to_string().contains("table.h5"), "{error}");
    }
}

#[test]
fn tables_of_rows_come_back_from_any_rank() {
    for ranks in 1..=4 {
        run("hdf5", ranks);
    }
}

fn errors_reach_every_rank(folder: &Path, comm: &SimpleCommunicator) {
    let last = comm.size() - 1;
    let mine = if comm.rank() == last { Err(Error::Run("point 7".into())) } else { Ok(()) };
    let error = all_agree(comm, mine).unwrap_err();
    assert_eq!((error.exit_code(), error.to_string()), (1, "point 7".into()));
    assert!(all_agree(comm, Ok(())).is_ok());

    let taken = folder.join("taken");
    on_root(comm, || {
        std::fs::write(&taken, "not HDF5").unwrap();
        Ok(())
    })
    .unwrap();
    let file_error = |error: Error, part: &str| {
        assert_eq!(error.exit_code(), 3);
        assert!(error.to_string().contains(part), "{error}");
    };
    file_error(
        ResultsDirectory::create(&taken, true, &Inputs::default(), comm).unwrap_err(),
        "taken",
    );
    file_error(ResultsDirectory::reopen(&folder.join("absent"), comm).unwrap_err(), "absent");
    file_error(FileReader::open(&taken, comm).err().unwrap(), "not a readable HDF5 file");
    file_error(FileReader::open(&folder.join("absent.h5"), comm).err().unwrap(), "No such file");
    let path = folder.join("absent").join("points.h5");
    file_error(FileWriter::create(&path, comm).err().unwrap(), "No such file");

    let directory =
        ResultsDirectory::create(&folder.join("out"), false, &Inputs::default(), comm).unwrap();
    let versions = [("mpm-par".to_string(), "0.1.0".to_string())].into();
    Summary { versions, ..Summary::default() }.write(&directory, comm).unwrap();
    let error =
        ResultsDirectory::create(&folder.join("out"), false, &Inputs::default(), comm).unwrap_err();
    assert_eq!(error.exit_code(), 2);
    assert!(error.to_string().contains("--force"), "{error}");
    ResultsDirectory::create(&folder.join("out"), true, &Inputs::default(), comm).unwrap();
}

#[test]
fn errors_of_one_rank_are_errors_of_all() {
    for ranks in [1, 3] {
        run("errors", ranks);
    }
}
