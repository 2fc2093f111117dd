#!/usr/bin/env python3
"""Histories of an older program beside those of a newer one, over many decks on one and two ranks.

    jobs/before_after.py OLD OLD_INPUTS NEW NEW_INPUTS OUT [NAME ...]

OLD and NEW are programs, OLD_INPUTS and NEW_INPUTS folders with the decks as each of them reads them,
OUT a folder for results. Prints the table of docs/evidence/before-after.md. Of each column the largest
difference is taken over the largest value of all columns of its kind (all reactions in N, say), so that
what is zero by symmetry is not compared with itself. Counts of iterations, times and costs are left out.
"""

import csv
import re
import subprocess
import sys
from pathlib import Path

CONTINUED = ['method.gimp_edge="published"']
# Deck: settings of both, settings of the newer program alone.
CASES = {
    "beam": ([], []),
    "beam-lagrangian": (["grid.h=0.25"], []),
    "beam-fem": ([], []),
    "beam-3d": ([], []),
    "column": ([], []),
    "column-3d": ([], []),
    "column-ghost": ([], []),
    "collapse": ([], []),
    "collapse-gimp": ([], []),
    "cube-collapse": ([], CONTINUED),
    "shear": ([], []),
    "shear-3d": (["analysis.steps=15"], []),
    "stretch": ([], []),
    "twist": ([], CONTINUED),
    "arch": ([], CONTINUED),
    "doughnut-10": ([], []),
    "ellipse": (["analysis.steps=8"], []),
    "annulus-mms": ([], []),
    "annulus-unstructured": ([], []),
    "mms-2d": ([], CONTINUED),
    "mms-2d-mesh": ([], []),
    "mms-3d": ([], CONTINUED),
    "mms-3d-mesh": ([], []),
    "block-3d": (["grid.cells=[12,12,13]", "grid.h=0.08333333333333333"], []),
    "scaling": (["analysis.steps=1", "body.0.shape={box={min=[0,0],max=[4,4]}}"], CONTINUED),
    "bar-vibration": ([], []),
    "translating-ghost": (["analysis.steps=50"], []),
    "translating-domain-gimp": (["analysis.steps=100"], []),
    "translating-domain-mpm": (["analysis.steps=100"], []),
    "stretching-ghost": (["analysis.steps=200", "analysis.duration=0.2"], []),
    "stretching-ghost-3d": (["analysis.steps=20", "analysis.duration=0.1"], []),
    "ghost-collision": (["analysis.steps=200", "analysis.duration=0.7"], []),
    "ghost-collision-plastic": (
        ["grid.h=0.1", "analysis.steps=150", "analysis.duration=0.9"], []),
    "ghost-collision-3d": (["analysis.steps=30", "analysis.duration=0.15"], []),
    "slump": (["analysis.duration=0.01"], CONTINUED),
}
LEFT_OUT = ("wall_seconds", "imbalance", "moved_points", "residual ", "linear_iterations")


def run(program, inputs, name, ranks, settings, out):
    words = [word for setting in settings for word in ("--set", setting)]
    command = ["mpirun", "-n", str(ranks), program, f"{inputs}/{name}.toml", *words]
    done = subprocess.run([*command, "--out", str(out), "--force"], capture_output=True, text=True,
                          stdin=subprocess.DEVNULL)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(command)}: {done.stderr[-500:]}")


def history(out):
    rows = list(csv.reader((out / "history.csv").open()))
    return {head: [float(row[i] or "nan") for row in rows[1:]] for i, head in enumerate(rows[0])}


def kind(head):
    unit = re.search(r"\[(.*)\]", head).group(1)
    for word in ("energy", "momentum", "angular"):
        if head.startswith(word):
            return unit, word
    return unit, ""


def sizes(table):
    """Largest value of each kind of column; a momentum is at least what the kinetic energy has."""
    most = {}
    for head, values in table.items():
        finite = [abs(value) for value in values if abs(value) < float("inf")]
        most[kind(head)] = max([most.get(kind(head), 0.0), *finite])
    kinetic = max((abs(v) for v in table.get("energy_kinetic [J/m]",
                                             table.get("energy_kinetic [J]", [0.0]))), default=0.0)
    for key in most:
        if key[1] in ("momentum", "angular"):
            # Speeds of these decks are at least 0.1 m/s: p = 2 E / v.
            most[key] = max(most[key], kinetic)
    return most


def differences(old, new):
    most, found = sizes(old), {}
    for head, values in old.items():
        if head.startswith(LEFT_OUT) or head not in new or head.startswith("velocity_error"):
            continue
        if len(values) != len(new[head]):
            return {"rows": float("inf")}
        pairs = [(a, b) for a, b in zip(values, new[head]) if a != b and not (a != a and b != b)]
        if head.startswith("kappa"):
            # Condition numbers differ by orders of magnitude, and near 1 / round-off have no digits.
            found[head] = max((abs(a - b) / a for a, b in pairs if a < 1e8), default=0.0)
        else:
            apart = max((abs(a - b) for a, b in pairs), default=0.0)
            found[head] = apart / (most[kind(head)] or 1.0)
    return found


def words(found):
    if "rows" in found:
        return "other steps"
    reactions = {h: d for h, d in found.items() if h.startswith("reaction")}
    others = {h: d for h, d in found.items() if not h.startswith("reaction")}
    of = lambda part: f"{max(part.values(), default=0.0):.1e}"
    return f"{of(reactions) if reactions else '-'}, {of(others)}"


def main():
    old, old_inputs, new, new_inputs, out, *names = sys.argv[1:]
    print("| deck | settings | 1 rank: reactions, rest | 2 ranks: reactions, rest | older, 2 ranks over 1 |")
    print("|---|---|---|---|---|")
    for name in names or CASES:
        both, newer = CASES[name]
        cells, olds = [], []
        for ranks in (1, 2):
            here = [Path(out) / f"{which}-{name}-{ranks}" for which in ("old", "new")]
            run(old, old_inputs, name, ranks, both, here[0])
            run(new, new_inputs, name, ranks, both + newer, here[1])
            olds.append(history(here[0]))
            cells.append(words(differences(olds[-1], history(here[1]))))
        itself = max(differences(*olds).values())
        settings = " ".join(both + [f"({setting})" for setting in newer])
        print(f"| {name} | {settings} | {cells[0]} | {cells[1]} | {itself:.1e} |", flush=True)


if __name__ == "__main__":
    main()
