"""Resistance of cones over depth, from history.csv of runs.

cone.py TRESCA=0.175 SAND=0.105 CLAY=0.105 -o cone-depth.png
TRESCA: folder of inputs/cone-deep.toml; SAND: of inputs/cone-sand.toml; CLAY: of the latter with the material of its header.
After "=" stands the way of the cone in m. Needs matplotlib.
"""

import argparse
import csv
import math
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

RADIUS = 0.0175  # m


def curve(folder, path):
    """Depths (radii) and pressures on the cone (Pa) of a run."""
    with open(Path(folder) / "history.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    depth = [float(row["load_factor [-]"]) * path / RADIUS for row in rows]
    area = math.pi * RADIUS**2
    return depth, [abs(float(row["reaction.cone.y [N]"])) / area for row in rows]


def means(depth, values, width=1.0):
    """Means over a radius around each depth."""
    out = []
    for d in depth:
        near = [v for x, v in zip(depth, values) if abs(x - d) <= 0.5 * width]
        out.append(sum(near) / len(near))
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", nargs="+", metavar="DIR=PATH", help="folder of a run and way of its cone in m")
    parser.add_argument("-o", "--output", required=True)
    args = parser.parse_args()
    runs = [(folder, *curve(folder, float(path))) for folder, path in (a.rsplit("=", 1) for a in args.folders)]
    figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.6), dpi=80, layout="constrained")
    left.axhspan(9.72, 10.77, color="0.9", label="9.72 to 10.77, smooth")
    labels = ["Tresca, smooth", "sand, 30 degrees", "Cam-clay, drained"]
    for label, (_, depth, q) in zip(labels, runs):
        axis, scale = (left, 10e3) if label.startswith("Tresca") else (right, 100e3)
        values = [v / scale for v in q]
        (line,) = axis.plot(depth, values, lw=0.4, alpha=0.6)
        axis.plot(depth, means(depth, values), color=line.get_color(), label=label)
    left.set(xlabel="way / r", ylabel="q / c_u", xlim=(0, 10), ylim=(0, None))
    right.set(xlabel="way / r", ylabel="(q - p_0) / p_0", xlim=(0, 6), ylim=(0, None))
    left.legend(loc="lower right", fontsize=8)
    right.legend(loc="lower right", fontsize=8)
    figure.savefig(args.output)


if __name__ == "__main__":
    main()
