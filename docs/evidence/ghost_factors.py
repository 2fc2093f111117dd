"""Cases over ghost.stiffness_factor, for ghost-factors.md.

python3 docs/evidence/ghost_factors.py PROGRAM CASE, with CASE one of beam, column, collapse, disc,
large, ball. One row per factor (0: ghost = "off"), one entry per place of the body on the grid.
"""

import json
import math
import os
import subprocess
import sys
import tempfile

PROGRAM, CASE = sys.argv[1], sys.argv[2]
WORK = tempfile.mkdtemp()
FACTORS = [0, 1e-3, 1e-2, 3e-2, 1e-1, 1]
# The solver of large systems.
MULTIGRID = "-qs_ksp_type cg -qs_pc_type mg -qs_ksp_rtol 1e-8 -qs_ksp_max_it 1000".split()


def run(factor, deck, words=()):
    """The summary of a run that succeeded, else None."""
    ghost = '"off"' if factor == 0 else f"{{ stiffness_factor = {factor} }}"
    path, out = f"{WORK}/case.toml", f"{WORK}/out"
    with open(path, "w") as file:
        file.write(f"ghost = {ghost}\n{deck}\n[output]\nevery = 1000\n")
    done = subprocess.run(
        [PROGRAM, path, "--out", out, "--force", *words],
        stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if done.returncode == 2:
        sys.exit(done.stderr)
    if done.returncode:
        return None
    with open(f"{out}/summary.json") as file:
        return json.load(file)


def deck(analysis, basis, grid, material, body, conditions, verify=()):
    figures = "".join(
        f'[[verify]]\nname = "{norm}"\nfield = "{field}"\nexact = "{exact}"\nnorm = "{norm}"\n'
        f"scale = {scale}\n" for norm, field, exact, scale in verify)
    return (
        f'[analysis]\ntype = "quasi-static"\n{analysis}\n[method]\nbasis = "{basis}"\n'
        f'[grid]\ntype = "lattice"\n{grid}\n[material.m]\npoisson = 0.3\n{material}\n'
        f'[[body]]\nname = "body"\nmaterial = "m"\n{body}\n{conditions}\n{figures}')


def beam(factor, h, shift):
    """Largest displacement of a cantilever 4 m long, 0.5 m thick; evaluations."""
    text = deck(
        "steps = 5\ntolerance = 1e-8", "gimp",
        f"origin = [0, {-2 - shift * h}]\nsize = [5, 4]\nh = {h}",
        'model = "hencky"\nyoung = 1e6',
        "density = 0\nshape = { box = { min = [0, -0.25], max = [4, 0.25] } }\n"
        f"lattice = {{ spacing = {h / 3}, offset = [{h / 6}, {h / 6}] }}",
        '[[boundary]]\nwhere = { side = "left" }\nfix = ["x", "y"]\n'
        "[[load]]\npoint = { nearest = [[3.98, -0.01], [3.98, 0.01]], force = [0, -600] }",
        [("max", "displacement.y", "0", 1)]).replace("poisson = 0.3", "poisson = 0.2")
    found = run(factor, text)
    return found and f"{found['verify']['max']:.4f} m, {found['newton_iterations']['total']}"


def column(factor, young, cells):
    """Error of the stress over that at the base: mean, largest; evaluations."""
    h = 50 / cells
    sides = "".join(
        f'[[boundary]]\nwhere = {{ side = "{side}" }}\nfix = ["{axis}"]\n'
        for side, axis in (("bottom", "y"), ("left", "x"), ("right", "x")))
    exact = "80*10*(Y-50)"
    text = deck(
        "steps = 40", "gimp", f"size = [{h}, 50]\nh = {h}",
        f'model = "hencky"\nyoung = {young}',
        'density = 80\nshape = { where = "y <= 50" }\npoints_per_cell = [2, 2]',
        sides + "[[load]]\ngravity = [0, -10]",
        [("volume-l1", "stress.yy", exact, 4e4), ("max", "stress.yy", exact, 4e4)])
    found = run(factor, text.replace("poisson = 0.3", "poisson = 0.0"))
    return found and (f"{found['verify']['volume-l1']:.5f}, {found['verify']['max']:.5f}, "
                      f"{found['newton_iterations']['total']}")


def collapse(factor, basis, shift, height):
    """Extent to the right and upwards of a plastic block 6 m wide; evaluations."""
    text = deck(
        "steps = 20", basis, f"origin = [{-6 - shift}, 0]\nsize = [12, 8]\nh = 0.5",
        'model = "von-mises"\nyoung = 1e6\nyield = 12e3',
        f"density = 1000\nshape = {{ box = {{ min = [-3, 0], max = [3, {height}] }} }}\n"
        "lattice = { spacing = 0.125, offset = [0.0625, 0.0625] }",
        '[[boundary]]\nwhere = { side = "bottom" }\nfix = ["x", "y"]\n'
        "[[load]]\ngravity = [0, -10]")
    found = run(factor, text)
    if not found:
        return None
    x, y = found["bodies"]["body"]["extent_max"]
    return f"{x:.3f} m, {y:.3f} m, {found['newton_iterations']['total']}"


def disc(factor, dimension, cells, place, amplitude, steps):
    """Linear iterations a solve; errors of the stress over E times the amplitude: mean, largest.

    The swelling disc or ball of jobs/bench/iterations.rs.
    """
    h = 1 / cells
    s = h / 2
    reach = int(1.1 / s) * 2
    every = range(-reach, reach)
    with open(f"{WORK}/points.csv", "w") as file:
        file.write("x,y,volume\n" if dimension == 2 else "x,y,z,volume\n")
        for i in every:
            for j in every:
                for k in every if dimension == 3 else [0]:
                    x, y, z = (i + 0.5) * s, (j + 0.5) * s, (k + 0.5) * s
                    if dimension == 2:
                        z = 0.0
                    else:
                        y, z = (math.cos(0.3) * y - math.sin(0.3) * z,
                                math.sin(0.3) * y + math.cos(0.3) * z)
                    x, y = (math.cos(0.5) * x - math.sin(0.5) * y,
                            math.sin(0.5) * x + math.cos(0.5) * y)
                    if x * x + y * y + z * z < 1:
                        point = [x, y, z][:dimension] + [s ** dimension]
                        file.write(",".join(map(repr, point)) + "\n")
    nu, n, a = 0.3, dimension, amplitude
    lam, mu = nu / ((1 + nu) * (1 - 2 * nu)), 1 / (2 * (1 + nu))
    c = (n * lam + 2 * mu) / ((n + 2) * lam + 6 * mu)
    force = a * c * ((2 * n + 4) * lam + (4 * n + 8) * mu)
    axes = "XYZ"[:n]
    r2 = "(" + "+".join(f"{axis}*{axis}" for axis in axes) + ")"
    stress = f"{a}*({lam}*({n}-{c}*({n}+2)*{r2})+2*{mu}*(1-{c}*{r2}-2*{c}*X*X))"
    moved = ", ".join(f'{axis.lower()} = "{a}*(1-{c}*{r2})*{axis}"' for axis in axes)
    pad = 0.4 if steps > 1 else 2 * h
    text = deck(
        f"steps = {steps}", "gimp",
        f"origin = {[-1 - pad + place[i] * h for i in range(n)]}\n"
        f"cells = {[round((2 + 2 * pad) / h)] * n}\nh = {h}",
        'model = "hencky"\nyoung = 1.0', 'density = 1\nshape = { points = "points.csv" }',
        f"[[boundary]]\nwhere = {{ box = {{ min = {[-3] * n}, max = {[3] * (n - 1) + [-0.7]} }} }}\n"
        f"displacement = {{ {moved} }}\n"
        f"[[load]]\nbody_force = {[f'{force}*{axis}' for axis in axes]}",
        [("volume-l2", "stress.xx", stress, a), ("max", "stress.xx", stress, a)])
    found = run(factor, text, MULTIGRID)
    if not found:
        return None
    solves = found["newton_iterations"]["total"] - found["steps_completed"]
    return (f"{found['linear_iterations']['total'] / solves:.1f}, "
            f"{found['verify']['volume-l2']:.4f}, {found['verify']['max']:.3f}")


PLACES = [[0, 0, 0], [0.25, 0.4, 0.6], [0.5, 0.15, 0.3], [0.77, 0.6, 0.9]]
CASES = {
    "beam": (beam, [[(h, s) for s in (0, 0.1, 0.5, 0.95)] for h in (0.25, 0.125)]),
    "column": (column, [[(young, n) for n in (32, 128)] for young in (1e6, 1e4)]),
    "collapse": (collapse, [
        [(basis, s, y) for s, y in ((0, 4), (0.06, 4.125), (0.2, 4.25), (0.47, 4.375))]
        for basis in ("gimp", "mpm")]),
    "disc": (disc, [[(2, n, place, 1e-4, 1) for place in PLACES] for n in (16, 32)]),
    "large": (disc, [[(2, 16, place, 0.2, 4) for place in PLACES]]),
    "ball": (disc, [[(3, n, place, 1e-4, 1) for place in PLACES] for n in (3, 6)]),
}
measure, groups = CASES[CASE]
for group in groups:
    print(f"{CASE} {group[0]}", flush=True)
    for factor in FACTORS:
        print(f"  {factor}:", " | ".join(measure(factor, *of) or "fails" for of in group), flush=True)
