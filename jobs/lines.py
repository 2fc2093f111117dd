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
        "system/terms/own_traction.rs", "system/terms/block.rs", "deck/sections/surfaces.rs"],
    "contact and rigid bodies": [
        "contact/*", "analysis/explicit_bodies.rs", "analysis/explicit_contact.rs",
        "analysis/free_bodies.rs", "analysis/free_motion.rs", "system/apart.rs",
        "system/facing.rs", "system/shared_nodes.rs", "system/terms/contact.rs",
        "system/terms/facing.rs", "system/terms/node_gaps.rs", "system/terms/touching.rs",
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
        "run/aside.rs", "run/plan_checks.rs", "run/thin.rs", "run/start_checks/contest.rs"],
    "libraries of other make: BLAS kernels, factors, serial HDF5, launchers": [
        "petsc/blas.rs", "petsc/factors.rs", "parallel/launcher.rs"],
}


def git(*words):
    return subprocess.run(["git", *words], check=True, capture_output=True, text=True).stdout


def counts(path, text):
    """Code, comment, blank and test lines of a file."""
    lines, of = text.splitlines(), Counter()
    tests = path.endswith("tests.rs") or "/tests/" in path
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
    folders, subjects = defaultdict(Counter), defaultdict(Counter)
    for file in git("ls-tree", "-r", "--name-only", revision, "src").split():
        if not file.endswith(".rs"):
            continue
        path = file.removeprefix("src/")
        of = counts(path, git("show", f"{revision}:{file}"))
        folders[path.split("/")[0] if "/" in path else "(top)"].update(of)
        subjects[subject(path)].update(of)
    return folders, subjects


def cells(of):
    parts = [of["code"], of["comments"], of["tests"]]
    return " | ".join(f"{n:,}".replace(",", " ") for n in [sum(of.values()), *parts])


def total(table):
    return sum(table.values(), Counter())


def main():
    old, new = (sys.argv[1:] + ["1571419", "HEAD"][len(sys.argv) - 1:])[:2]
    (before, _), (after, subjects) = survey(old), survey(new)
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
    print(f"| {old}, all files | {cells(total(before))} |")


if __name__ == "__main__":
    main()
