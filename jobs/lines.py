#!/usr/bin/env python3
"""Lines of src/ at two revisions, by folder: code, comments, tests; and those of subjects that came between.

    jobs/lines.py [OLD] [NEW]            (default: 1571419 and HEAD)

A file counts as new where its whole subject came after OLD (the list NEW_SUBJECTS). All other files count as old,
with all that has been added to them: the figure for old subjects is an upper bound. Tests are modules under
#[cfg(test)] and files of tests; blank lines of code are counted apart.
"""

import fnmatch
import re
import subprocess
import sys
from collections import Counter, defaultdict

# Subject: files that have no other.
NEW_SUBJECTS = {
    "material models and state variables": [
        "material/cam_clay.rs", "material/drucker_prager.rs", "material/mohr_coulomb.rs",
        "material/neo_hookean.rs", "material/published*.rs", "material/softening*.rs",
        "material/tresca.rs", "material/parameter.rs", "points/named.rs", "run/materials.rs"],
    "F-bar": [
        "basis/box_means.rs", "basis/cell_parts.rs", "basis/centre.rs", "mechanics/dilation.rs",
        "system/cell_rows.rs", "run/locking.rs"],
    "axisymmetry": [
        "basis/radial.rs", "mechanics/ring.rs", "deck/sections/axisymmetry.rs"],
    "element tests, strength reduction, damping, initial stress": [
        "analysis/element_test.rs", "run/element_run.rs", "deck/sections/element_test.rs",
        "analysis/strength_reduction.rs", "analysis/damping.rs", "run/initial_stress.rs",
        "analysis/initial_balance.rs", "deck/sections/initial_stress.rs"],
    "stages": [
        "analysis/release.rs", "analysis/stage_changes.rs", "deck/sections/stages.rs",
        "deck/stage.rs"],
    "pressures, tractions, water, surfaces of bodies, supports off the nodes": [
        "surface/*", "run/surfaces.rs", "loads/pressing.rs", "loads/pressure.rs",
        "loads/surface_pressure.rs", "loads/traction.rs", "loads/water.rs", "system/supports.rs",
        "system/terms/pressure.rs", "system/terms/surface.rs", "system/terms/following.rs",
        "system/terms/own_traction.rs", "system/terms/block.rs", "deck/sections/surfaces.rs",
        "system/carried.rs", "system/holds.rs"],
    "springs below points": ["system/terms/foundation.rs"],
    "contact and rigid bodies": [
        "contact/*", "analysis/explicit_bodies.rs", "analysis/explicit_contact.rs",
        "analysis/free_bodies.rs", "analysis/free_motion.rs", "system/apart.rs",
        "system/facing.rs", "system/shared_nodes.rs", "system/terms/contact/*",
        "system/terms/facing.rs", "system/terms/touching.rs",
        "record/contact.rs", "deck/*/contact.rs", "output/series/rigid_file.rs"],
    "unsymmetric systems, penalties under multigrid": [
        "amg/block_smoother.rs", "amg/symmetric_part.rs", "amg/tied.rs",
        "analysis/equilibrium/ties.rs", "petsc/smoother.rs"],
    "affine transfers (APIC, TPIC)": ["transfer/affine.rs"],
    "solids from files, terrain, points of other programs, exact cover of shapes": [
        "deck/solid/*", "points/file/cloud.rs", "points/file/legacy.rs", "points/file/xml.rs",
        "points/coverage.rs", "points/overlap.rs", "points/sub_cells.rs", "deck/crossing.rs",
        "deck/model/stations.rs"],
    "Gmsh 2.2 to 4.1 (a crate before)": ["grid/msh/*"],
    "report, plots, VTK series, probes": [
        "output/report/*", "output/plot/*", "output/series/vtkhdf.rs", "output/series/vtu.rs",
        "record/probes.rs", "deck/sections/probes.rs"],
    "help with decks: --new, --list, --explain, --schema, warnings of the plan": [
        "deck/templates.rs", "deck/list.rs", "deck/explain.rs", "deck/json_schema.rs",
        "run/aside.rs", "run/plan_checks.rs", "run/thin.rs", "run/lengths.rs", "run/start_checks/contest.rs"],
    "libraries of other make: BLAS kernels, factors, serial HDF5, launchers": [
        "petsc/blas.rs", "petsc/factors.rs", "parallel/launcher.rs"],
}


def git(*words):
    return subprocess.run(["git", *words], check=True, capture_output=True, text=True).stdout


def test_files(files):
    """Files that are modules of tests; files: path to text."""
    declared = re.compile(r"#\[cfg\(test\)\]\n(?:pub\(\w+\) )?mod (\w+);")
    found = {path for path in files if path.endswith("tests.rs") or "/tests/" in path}
    for path, text in files.items():
        folder = path.rpartition("/")[0] if path.endswith("/mod.rs") else path.removesuffix(".rs")
        found |= {f"{folder}/{name}.rs".removeprefix("lib/") for name in declared.findall(text)}
    return found


def counts(text, tests):
    """Code, comment, blank and test lines of a file; tests: it is a module of tests."""
    lines, of = text.splitlines(), Counter()
    marked = False
    for line in lines:
        word = line.strip()
        if tests:
            of["tests"] += 1
        elif line.startswith("#[cfg(test)]"):
            marked = True
            of["tests"] += 1
        elif marked:
            of["tests"] += 1
            tests = re.match(r"mod \w+ \{", line) is not None
            marked = line.startswith("#[")
        elif not word:
            of["blank"] += 1
        else:
            of["comments" if word.startswith("//") else "code"] += 1
    return of


def subject(path):
    for name, patterns in NEW_SUBJECTS.items():
        if any(fnmatch.fnmatch(path, pattern) for pattern in patterns):
            return name
    return None


def survey(revision):
    folders, subjects, old = defaultdict(Counter), defaultdict(Counter), defaultdict(Counter)
    names = git("ls-tree", "-r", "--name-only", revision, "src").split()
    files = {
        name.removeprefix("src/"): git("show", f"{revision}:{name}")
        for name in names if name.endswith(".rs")}
    tests = test_files(files)
    for path, text in files.items():
        of = counts(text, path in tests)
        folder = path.split("/")[0] if "/" in path else "(top)"
        folders[folder].update(of)
        subjects[subject(path)].update(of)
        if subject(path) is None:
            old[folder].update(of)
    return folders, subjects, old


# Parts that do what they did at OLD: folders then and now, without the files of new subjects.
PARTS = [
    ("solvers", ["petsc", "multigrid"], ["petsc", "amg", "blocks"]),
    ("grid", ["grid"], ["grid"]),
    ("ghost, tensor", ["ghost", "tensor"], ["ghost", "tensor"]),
    ("parallel", ["parallel"], ["parallel"]),
    ("basis, mechanics, material", *[["basis", "mechanics", "material"]] * 2),
    ("points", ["points"], ["points"]),
    ("equations, steps, records", ["analysis", "assembly"],
     ["analysis", "system", "mass", "transfer", "loads", "record", "run"]),
    ("output", ["output"], ["output"]),
    ("deck, command line", ["deck", "(top)"], ["deck", "(top)"]),
]


def cells(of):
    parts = [of["code"], of["comments"], of["tests"]]
    return " | ".join(f"{n:,}".replace(",", " ") for n in [sum(of.values()), *parts])


def total(table):
    return sum(table.values(), Counter())


def main():
    old, new = (sys.argv[1:] + ["1571419", "HEAD"][len(sys.argv) - 1:])[:2]
    (before, _, then), (after, subjects, now) = survey(old), survey(new)
    print("| folder | lines then | code | comments | tests | lines now | code | comments | tests |")
    print("|---|---|---|---|---|---|---|---|---|")
    for folder in sorted(set(before) | set(after)):
        print(f"| `{folder}` | {cells(before[folder])} | {cells(after[folder])} |")
    print(f"| all | {cells(total(before))} | {cells(total(after))} |\n")
    print("| subject that came since | lines | code | comments | tests |\n|---|---|---|---|---|")
    for name in NEW_SUBJECTS:
        print(f"| {name} | {cells(subjects[name])} |")
    fresh = total({name: of for name, of in subjects.items() if name})
    print(f"| all of them | {cells(fresh)} |")
    print(f"| files of subjects that were there | {cells(subjects[None])} |")
    print(f"| {old}, all files | {cells(total(before))} |\n")
    print("| part, without new subjects | lines then | code then | lines now | code now |\n|---|---|---|---|---|")
    for name, folders_then, folders_now in PARTS:
        pair = [sum((table[f] for f in folders), Counter())
                for table, folders in [(then, folders_then), (now, folders_now)]]
        print(f"| {name} | " + " | ".join(f"{sum(of.values())} | {of['code']}" for of in pair) + " |")


if __name__ == "__main__":
    main()
