"""Share of contact in an explicit step, by instructions: contact_share.py PROGRAM [CELLS]

A column of CELLS x CELLS x 5 CELLS cells (10) with 8 points each stands on a rigid floor: 1 % of its points touch it with 10 cells.
callgrind counts the instructions of 2 and of 12 steps of a column that falls freely, that stands on a smooth floor and on one
with friction; their difference is that of ten steps. Neither neighbours on the machine nor caches change the counts. The
sides of the column lie within cells: on grid lines they would bulge beyond by less than round-off of a cell, and nodes that hold
almost no mass would be handled in the steps with a floor and in no others.
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

SHORT, LONG, STEP = 2, 12, 1e-5


def deck(cells, friction):
    h = 1 / 50
    low, wide, high = -2 * h, cells * h, 5 * cells * h
    near, far = h / 2, wide + h / 2
    contact = ""
    if friction is not None:
        contact = (
            '[[rigid]]\nname = "floor"\nshape = { half_space = { point = [0, 0, 0], normal = [0, 0, 1] } }\n'
            f'[[contact]]\nbetween = ["floor", "block"]\nfriction = {friction}\n'
        )
    return f"""[analysis]
type = "explicit"
steps = {SHORT}
duration = {SHORT * STEP}
[method]
basis = "gimp"
mass = "lumped"
domain_update = "stretch"
[grid]
type = "lattice"
origin = [{low}, {low}, {low}]
size = [{wide + 5 * h}, {wide + 5 * h}, {high + 4 * h}]
h = {h}
[material.rubber]
model = "neo-hookean"
young = 1e6
poisson = 0.3
[[body]]
name = "block"
material = "rubber"
density = 1000.0
shape = {{ box = {{ min = [{near}, {near}, 0], max = [{far}, {far}, {high}] }} }}
[[load]]
gravity = [0, 0, -10]
[output]
every = 1000
report = false
{contact}"""


def instructions(program, folder, steps):
    command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={folder}/counts", program, "case.toml"]
    command += ["--out", "out", "--force", "--quiet", "--set", f"analysis.steps={steps}"]
    command += ["--set", f"analysis.duration={steps * STEP}"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    return int(re.search(r"Collected : (\d+)", done.stderr).group(1))


def main():
    program = str(Path(sys.argv[1]).resolve())
    cells = int(sys.argv[2]) if len(sys.argv) > 2 else 10
    alone = None
    print("| floor | million instructions a step | share of contact |\n|---|---|---|")
    for name, friction in (("none", None), ("smooth", 0.0), ("friction 0.3", 0.3)):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "case.toml").write_text(deck(cells, friction))
            short, long = (instructions(program, folder, steps) for steps in (SHORT, LONG))
        step = (long - short) / (LONG - SHORT) / 1e6
        alone = alone or step
        print(f"| {name} | {step:.1f} | {100 * (1 - alone / step):.1f} % |", flush=True)


if __name__ == "__main__":
    main()
