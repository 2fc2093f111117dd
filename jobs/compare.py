#!/usr/bin/env python3
"""This program beside KratosMPMApplication, in turn, on one core of this machine.

compare.py [--repeat 3] [--out docs/compare.csv] [--only beam|block] [--quick]

Kratos comes from PyPI into a virtual environment under target/compare. Both get the same points,
cells, steps, load and linear tolerance. Each line of the table is the median of the repeats;
processor time is compared beside wall time, as it does not mind what else runs. Needs Python's
standard library only.
"""
import argparse
import csv
import json
import os
import resource
import statistics
import subprocess
import sys
import time

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
FOLDER = os.path.join(ROOT, "target/compare")
PYTHON = os.path.join(FOLDER, "venv/bin/python")
PROGRAM = os.path.join(ROOT, "target/release/mpm-par")
ENV = dict(os.environ, OMP_NUM_THREADS="1", MKL_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")

AMGCL = {"solver_type": "amgcl", "tolerance": 1e-8, "max_iteration": 1000, "krylov_type": "cg",
         "smoother_type": "spai0", "block_size": 3}


def cases(quick):
    """Name, what Kratos gets, what this program gets."""
    h, cells = (0.25, 8) if quick else (0.125, 24)
    force, steps = 600.0, 20
    beam = {"h": h, "points": 4, "force": force, "young": 12e6, "poisson": 0.2,
            # Kratos leaves out points without mass.
            "density": 1e-9, "steps": steps, "law": "hencky", "kratos_tolerance": 1e-8,
            "linear": "default"}
    ours = ["inputs/beam-lagrangian.toml", "--set", "method.basis=mpm", "--set", f"grid.h={h}",
            "--set", "method.domain_update=none", "--set", "body.0.points_per_cell=[4, 4]",
            "--set", f"analysis.steps={steps}", "--set", "analysis.tolerance=1e-8",
            "--set", f"load.0.point.force=[0, -{force}]", "--set", "output.every=1000",
            # Less memory than the direct solver, the default at this size, and a little faster.
            "--set", 'petsc.qs_ksp_type="cg"', "--set", 'petsc.qs_pc_type="mg"',
            "--set", "petsc.qs_ksp_rtol=1e-8"]
    block = {"cells": cells, "points": 2, "gravity": 10.0, "young": 1e6, "poisson": 0.3,
             "density": 1000.0, "steps": 4, "law": "hencky", "kratos_tolerance": 1e-8,
             "linear": AMGCL}
    solid = ["inputs/block-3d.toml", "--set", f"grid.cells=[{cells}, {cells}, {cells + 1}]",
             "--set", f"grid.h={1 / cells!r}"]
    return [("beam", beam, ours), ("block", block, solid)]


def require_kratos():
    if not os.path.exists(PYTHON):
        print("compare: a virtual environment in target/compare/venv", flush=True)
        subprocess.run([sys.executable, "-m", "venv", os.path.join(FOLDER, "venv")], check=True)
    found = subprocess.run([PYTHON, "-c", "import KratosMultiphysics.MPMApplication"],
                           capture_output=True)
    if found.returncode:
        print("compare: installing KratosMPMApplication", flush=True)
        done = subprocess.run([PYTHON, "-m", "pip", "install", "-q", "KratosMPMApplication"])
        if done.returncode:
            sys.exit("compare: pip could not install KratosMPMApplication (its words are above)")
    listed = subprocess.run([PYTHON, "-m", "pip", "list", "--format=json"], capture_output=True,
                            text=True, check=True)
    return next(p["version"] for p in json.loads(listed.stdout)
                if p["name"] == "KratosMPMApplication")


def kratos(name, settings):
    words = [PYTHON, os.path.join(ROOT, "jobs/compare_kratos.py"), name,
             os.path.join(FOLDER, name), json.dumps(settings)]
    done = subprocess.run(words, env=ENV, capture_output=True, text=True)
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    if done.returncode or not lines:
        reason = [line for line in (done.stdout + done.stderr).splitlines() if "Error:" in line]
        return {"failed": reason[-1].strip()[:200] if reason else f"exit code {done.returncode}"}
    row = json.loads(lines[-1])
    row["capped"] = sum("max iterations" in line for line in done.stdout.splitlines())
    return row


def ours(name, words):
    out = os.path.join(FOLDER, f"ours-{name}")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(["sh", os.path.join(ROOT, "jobs/mpirun.sh"), "1", PROGRAM] + words
                          + ["--out", out, "--force"], cwd=ROOT, env=ENV, capture_output=True,
                          text=True, stdin=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        return {"failed": (done.stdout + done.stderr)[-400:]}
    with open(os.path.join(out, "summary.json")) as file:
        summary = json.load(file)
    seconds = summary["wall_seconds"]
    body = next(iter(summary["bodies"].values()))
    # Processor time with set-up, output and mpirun: what Kratos spends on these is not counted.
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {"points": summary["points"], "steps": summary["steps_completed"],
            # Evaluations; a step's first is at zero displacement and solves nothing.
            "newton": summary["newton_iterations"]["total"] - summary["steps_completed"],
            "seconds": seconds["total"] - seconds["setup"] - seconds["output"], "cpu": cpu,
            "low": body["min"], "high": body["max"],
            "memory": summary["peak_memory_bytes"]["max"]}


def median_of(runs):
    bad = next((run for run in runs if "failed" in run), None)
    if bad:
        return bad
    row = dict(runs[0])
    for key in ("seconds", "cpu", "memory"):
        row[key] = statistics.median(run[key] for run in runs)
    return row


def main():
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("--repeat", type=int, default=3)
    words.add_argument("--only", choices=["beam", "block"])
    words.add_argument("--quick", action="store_true", help="small versions, to see that it works")
    words.add_argument("--out", default=os.path.join(ROOT, "target/compare/compare.csv"))
    words = words.parse_args()
    if not os.access(PROGRAM, os.X_OK):
        sys.exit("compare: target/release/mpm-par is missing: make build")
    version = require_kratos()
    table = []
    for name, settings, deck in cases(words.quick):
        if words.only not in (None, name):
            continue
        variants = {
            "mpm-par": lambda: ours(name, deck),
            f"Kratos {version}, Hencky": lambda: kratos(name, settings),
            f"Kratos {version}, neo-Hookean":
                lambda: kratos(name, dict(settings, law="neo-hookean")),
        }
        runs = {variant: [] for variant in variants}
        for _ in range(words.repeat):
            for variant, start in variants.items():
                begin = time.perf_counter()
                runs[variant].append(start())
                print(f"{name}: {variant}: {time.perf_counter() - begin:.1f} s with its start",
                      flush=True)
        for variant in variants:
            row = median_of(runs[variant])
            table.append({"case": name, "program": variant, "runs": words.repeat, **row})
    keys = ["case", "program", "runs", "points", "steps", "newton", "capped", "seconds", "cpu",
            "memory", "low", "high", "failed"]
    os.makedirs(os.path.dirname(words.out), exist_ok=True)
    with open(words.out, "w", newline="") as file:
        writer = csv.DictWriter(file, keys, restval="", extrasaction="ignore")
        writer.writeheader()
        writer.writerows(table)
    print("\n| case | program | steps | solves | wall s | processor s | memory MB | lowest, highest |")
    print("|---|---|---|---|---|---|---|---|")
    for row in table:
        if "failed" in row:
            print(f"| {row['case']} | {row['program']} | failed: {row['failed']} |||||||")
            continue
        axis = 1 if row["case"] == "beam" else 2
        print(f"| {row['case']}, {row['points']} points | {row['program']} | {row['steps']} | "
              f"{row['newton']} | {row['seconds']:.2f} | {row['cpu']:.2f} | "
              f"{row['memory'] / 1e6:.0f} | {row['low'][axis]:.6f}, {row['high'][axis]:.6f} |")
    for name in dict.fromkeys(row["case"] for row in table):
        rows = [row for row in table if row["case"] == name and "failed" not in row]
        if rows and rows[0]["program"] == "mpm-par":
            for row in rows[1:]:
                print(f"{name}, {row['program']} over mpm-par: wall "
                      f"{row['seconds'] / rows[0]['seconds']:.1f}, processor "
                      f"{row['cpu'] / rows[0]['cpu']:.1f}, memory "
                      f"{row['memory'] / rows[0]['memory']:.2f}")


if __name__ == "__main__":
    main()
