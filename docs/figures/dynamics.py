"""Pictures of docs/evidence/validation-dynamics.md from results directories.

python3 dynamics.py RESULTS OUT
RESULTS holds those of translating-domain-mpm, translating-domain-gimp, translating-ghost and
ghost-collision-plastic (with --set output.every=1), each under the name of its deck.
Needs numpy, h5py and matplotlib.
"""
import csv
import sys

import h5py
import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

results, out = sys.argv[1:]


def columns(case, *names):
    rows = list(csv.reader(open(f"{results}/{case}/history.csv")))
    titles = [title.split(" [")[0] for title in rows[0]]
    return [np.array([float(row[titles.index(name)]) for row in rows[1:]]) for name in names]


def save(figure, name, dpi=90):
    figure.tight_layout()
    figure.savefig(f"{out}/{name}.png", dpi=dpi)


def cfl():
    figure, row = plt.subplots(1, 2, figsize=(8, 2.8), sharey=True)
    for axes, basis in zip(row, ["mpm", "gimp"]):
        at, plain, ghost = columns(f"translating-domain-{basis}", "load_factor", "cfl", "cfl_ghost")
        axes.plot(2 * at, plain, "k", lw=0.8, label="plain")
        axes.plot(2 * at, ghost, "r", lw=1.6, label="stabilised")
        axes.set(title=basis, xlabel="a / h", ylim=(0, 0.3))
    row[0].set_ylabel("1 / (h sqrt(lambda_max))")
    row[0].legend(frameon=False)
    save(figure, "ghost-cfl")


def velocity():
    at, plain, ghost = columns("translating-ghost", "step", "velocity_error", "velocity_error_ghost")
    figure, axes = plt.subplots(figsize=(6, 2.8))
    axes.semilogy(at, np.maximum(plain, 1e-16), "k", lw=0.7, label="plain")
    axes.semilogy(at, np.maximum(ghost, 1e-16), "r", lw=1.0, label="stabilised")
    axes.set(xlabel="position", ylabel="largest |v - 1| [m/s]")
    axes.legend(frameon=False)
    save(figure, "ghost-velocity")


def energies():
    time, kinetic, strain, plastic = columns(
        "ghost-collision-plastic", "time", "energy_kinetic", "energy_strain", "energy_plastic"
    )
    figure, axes = plt.subplots(figsize=(5, 3.2))
    axes.plot(time, kinetic + strain, "k", label="kinetic + strain")
    axes.plot(time, kinetic, "k--", lw=1, label="kinetic")
    axes.plot(time, strain, "--", color="grey", lw=1, label="strain")
    axes.plot(time, plastic, "r", label="dissipated")
    axes.plot(time, kinetic + strain + plastic, "b:", lw=1, label="all")
    axes.set(xlabel="t [s]", ylabel="energy [J/m]", xlim=(0, 3.5), ylim=(0, 2.4))
    axes.legend(frameon=False, fontsize=8)
    save(figure, "ghost-energies")


def collision():
    steps = [(429, "1.5 s"), (571, "2.0 s"), (714, "2.5 s"), (857, "3.0 s")]
    figure, row = plt.subplots(1, 4, figsize=(10, 2.9))
    for axes, (step, title) in zip(row, steps):
        with h5py.File(f"{results}/ghost-collision-plastic/points-{step:06d}.h5") as file:
            x, strain = file["position"][:, :2], file["plastic_strain"][:].ravel()
        shown = axes.scatter(*x.T, c=strain, s=0.6, cmap="viridis", vmin=0, vmax=0.25)
        axes.set(title=title, xlim=(0, 1), ylim=(0, 1), aspect="equal", xticks=[], yticks=[])
    figure.colorbar(shown, ax=row, shrink=0.8, label="plastic strain")
    figure.savefig(f"{out}/ghost-collision.png", dpi=90, bbox_inches="tight")


cfl()
velocity()
energies()
collision()
