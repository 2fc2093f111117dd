"""Pictures of docs/evidence/validation-meshes.md from results directories.

python3 meshes.py RESULTS OUT
RESULTS holds doughnut-{mpm,cpdi1,cpdi2,fem} and ellipse-{mpm,cpdi1,cpdi2,fem}.
Needs numpy, h5py and matplotlib.
"""
import csv
import sys

import h5py
import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.collections import PolyCollection

results, out = sys.argv[1:]
METHODS = ["mpm", "cpdi1", "cpdi2", "fem"]


def column(case, name):
    rows = list(csv.reader(open(f"{results}/{case}/history.csv")))
    titles = [title.split(" [")[0] for title in rows[0]]
    pick = lambda word: np.array([float(row[titles.index(word)]) for row in rows[1:]])
    return 80 * pick("load_factor"), np.abs(pick(name))


def curves(case, name, scale, label):
    figure, axes = plt.subplots(figsize=(5, 3.2))
    for method, style in zip(METHODS, ["o-", "s-", "^-", "k--"]):
        angle, value = (np.append(0, v) for v in column(f"{case}-{method}", name))
        axes.plot(angle, value / scale, style, ms=3, lw=1, label=method)
    axes.set(xlabel="rotation [degrees]", ylabel=label, xlim=(0, 82), ylim=(0, None))
    axes.legend(frameon=False)
    figure.tight_layout()
    figure.savefig(f"{out}/{case}-reaction.png", dpi=90)


def points(case, hole, highest, step=16):
    figure, row = plt.subplots(1, 3, figsize=(11, 3.9), layout="constrained")
    around = np.linspace(0, 2 * np.pi, 400)
    turned = np.radians(-80)
    for axes, method in zip(row, ["mpm", "cpdi1", "cpdi2"]):
        with h5py.File(f"{results}/{case}-{method}/points-{step:06d}.h5") as file:
            x, strain = file["position"][:, :2], file["plastic_strain"][:].ravel()
            if "domain_corners" in file:
                corners = file["domain_corners"][:, :2].reshape(len(x), 4, 2)
                shown = PolyCollection(corners, edgecolors="k", linewidths=0.15, cmap="viridis")
                shown.set_array(strain)
                axes.add_collection(shown)
            else:
                shown = axes.scatter(*x.T, c=strain, s=4, cmap="viridis")
        # One scale for the three, so that colours compare.
        shown.set_clim(0, highest)
        a, b = hole[0] * np.cos(around), hole[1] * np.sin(around)
        rim = [np.cos(turned) * a - np.sin(turned) * b, np.sin(turned) * a + np.cos(turned) * b]
        axes.plot(*rim, "r", lw=0.8)
        axes.plot(10 * np.cos(around), 10 * np.sin(around), "r", lw=0.8)
        axes.set(title=method, xlim=(-10.4, 10.4), ylim=(-10.4, 10.4), aspect="equal", xticks=[], yticks=[])
    figure.colorbar(shown, ax=row, label="plastic strain", extend="max", shrink=0.85)
    figure.savefig(f"{out}/{case}-points.png", dpi=90)


curves("doughnut", "reaction.inner.sum_abs", 10 * np.pi * 1e6, "sum of nodal forces / (C E)")
curves("ellipse", "reaction.inner.torque", 31.73e6, "torque / (C E)")
points("doughnut", (5, 5), 2.5)
points("ellipse", (6, 4), 3.5)
