#!/usr/bin/env python3
"""Tables (csv) and plots (svg) of inputs/scaling.toml on more ranks and with more points.

scaling.py KIND [--ranks 1 2 4] [--h 0.03125] [--out docs/figures] [--repeat 3]

strong: one problem on more ranks. weak: as many points per rank, by finer cells. sizes: one rank
count, finer cells. These with Ghost stabilisation and, where --bare asks for it, without. memory: a
million points on 1, 2 and 4 ranks. work: one rank, linear solves to several tolerances, processor
time. all: these five, and a model for more ranks than there are.

Times are medians. On more ranks than the machine has cores a time says nothing about the
program: such rows keep their counts (messages, bytes, reductions, rows, iterations), and their
times are left empty. `all` runs each pair of ranks and cell size once and uses it wherever it is
needed; what it has measured is kept in --work, and --resume goes on from there.

A table gets its name when it is whole. Exit code 1 if a run with Ghost failed: its table and plots
are not written (without Ghost a failure leaves an empty row). Needs Python's standard library only.
"""
import argparse
import csv
import json
import math
import os
import re
import resource
import statistics
import subprocess
import sys

from scaling_model import exponent, model, write_model
from scaling_plots import PHASES, write_plots

ROOT = os.environ.get("ROOT") or os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PROGRAM = os.environ.get("PROGRAM") or os.path.join(ROOT, "target/release/mpm-par")
MACHINE = os.environ.get("MACHINE", "local")
COUNTS = ["h", "ghost", "points", "rows", "steps", "newton", "linear", "per_solve",
          "messages_max", "messages_mean", "bytes_max", "bytes_mean", "reductions",
          "own_messages_max", "own_bytes_max", "own_reductions", "replicated_bytes",
          "memory_max", "memory_mean", "imbalance"]
# Steps in 8 m: a whole number of cells along 9 m and 5 m needs a multiple of 8.
WIDTH, UNIT = 8.0, 8


def cores():
    """Physical cores that this process may use."""
    found = subprocess.run(["lscpu", "--parse=CORE,SOCKET"], capture_output=True, text=True)
    lines = {line for line in found.stdout.splitlines() if not line.startswith("#")}
    return min(len(lines) or 1, len(os.sched_getaffinity(0)))


def finer(h, times):
    """The cell size with about `times` as many cells in the plane."""
    cells = WIDTH / h * math.sqrt(times)
    return WIDTH / (UNIT * max(1, round(cells / UNIT)))


def processor_seconds():
    """Of all children so far."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def launched(ranks, h, ghost, out, more, patience):
    """Starts the program; its processor seconds, those of mpirun among them, or None."""
    words = [PROGRAM, os.path.join(ROOT, "inputs/scaling.toml"), "--out", out, "--force"]
    words += [word for word in more if word == "--check"]
    for setting in [f"grid.h={h!r}"] + ([] if ghost else ["ghost=off"]) + more:
        words += ["--set", setting] if setting != "--check" else []
    words += ["-log_view", ":" + out + ".log_view"]
    script = '. "$ROOT/jobs/machines/$MACHINE.sh"; launch "$@"'
    env = dict(os.environ, ROOT=ROOT, MACHINE=MACHINE)
    start = ["timeout", str(patience)] if patience else []
    before = processor_seconds()
    done = subprocess.run(start + ["bash", "-c", script, "bash", str(ranks)] + words, env=env,
                          stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if done.returncode:
        reason = [line for line in (done.stdout + done.stderr).splitlines() if "error:" in line]
        print(f"{ranks} ranks, h = {h:g}, Ghost {ghost}: exit code {done.returncode} "
              f"{reason[:1]}", flush=True)
        return None
    return processor_seconds() - before


def run(ranks, h, ghost, out, more, patience):
    """One run: summary, what the linear solver's log says, processor seconds; None if it failed."""
    names = (os.path.join(out, "summary.json"), out + ".log_view")
    for old in names:
        if os.path.exists(old):
            os.remove(old)
    seconds = launched(ranks, h, ghost, out, more, patience)
    if seconds is None or not all(os.path.exists(name) for name in names):
        return None
    with open(names[0]) as summary, open(names[1]) as log:
        return json.load(summary), log.read(), seconds


def logged(text, name):
    """Largest and mean over the ranks of a line of PETSc's log."""
    found = re.search(rf"^{re.escape(name)}:[ ]+(\S+)[ ]+(\S+)(?:[ ]+(\S+))?", text, re.M)
    if not found:
        return 0.0, 0.0
    largest = float(found.group(1))
    return largest, float(found.group(3)) if found.group(3) else largest


def row_of(ranks, h, ghost, out, repeat, more, limit, patience):
    """A table row: counts of the first run, medians of the times of all."""
    folder = os.path.join(out, f"{'ghost' if ghost else 'bare'}-{ranks}-{WIDTH / h:.0f}")
    runs = [run(ranks, h, ghost, folder, more, patience)
            for _ in range(repeat if ranks <= limit else 1)]
    if any(one is None for one in runs):
        return {"ranks": ranks, "h": h, "ghost": int(ghost)}
    summary, log, _ = runs[0]
    steps = summary["steps_completed"]
    # PETSc counts its own messages and bytes; those of the program itself come on top.
    own = summary["communication"]
    messages = logged(log, "MPI Msg Count")
    length = re.search(r"^MPI Msg Len \(bytes\):\s+(\S+)\s+\S+\s+\S+\s+(\S+)", log, re.M)
    bytes_ = (float(length.group(1)), float(length.group(2)) / ranks) if length else (0.0, 0.0)
    reductions = logged(log, "MPI Reductions")[0]
    newton = summary["newton_iterations"]["total"]
    linear = summary["linear_iterations"]["total"]
    memory = summary["peak_memory_bytes"]
    nodes = re.search(r"(\d+) equations", open(os.path.join(folder, "log.txt")).read())
    row = {
        "ranks": ranks, "h": h, "ghost": int(ghost),
        "points": summary["points"],
        "rows": int(nodes.group(1)) if nodes else 0,
        "steps": steps,
        "newton": newton,
        "linear": linear,
        # A step's first evaluation solves nothing.
        "per_solve": linear / max(1, newton - steps),
        "messages_max": messages[0] / steps + own["messages_max"],
        "messages_mean": messages[1] / steps + own["messages_mean"],
        "bytes_max": bytes_[0] / steps + own["bytes_max"],
        "bytes_mean": bytes_[1] / steps + own["bytes_mean"],
        "reductions": reductions / steps + own["reductions"],
        "own_messages_max": own["messages_max"],
        "own_bytes_max": own["bytes_max"],
        "own_reductions": own["reductions"],
        "replicated_bytes": own["replicated_bytes"],
        "memory_max": memory["max"],
        "memory_mean": memory["sum"] / ranks,
        "imbalance": summary["imbalance"],
    }
    if ranks <= limit:
        for phase in ["total"] + PHASES:
            times = [summary["wall_seconds"][phase] for summary, *_ in runs]
            row[phase] = statistics.median(times)
    return row


def write_table(path, rows, columns):
    with open(path, "w", newline="") as file:
        table = csv.DictWriter(file, columns, restval="")
        table.writeheader()
        for row in rows:
            table.writerow({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()})


def publish(path, write):
    """What `write` makes gets its name when it is whole."""
    write(path + ".partial")
    os.replace(path + ".partial", path)


def work(out, repeat, more, patience):
    """Processor seconds on one rank of solves to several tolerances, medians; None if one failed."""
    folder, h = os.path.join(out, "work"), 0.025
    starts = [launched(1, h, True, folder, more + ["--check"], patience) for _ in range(repeat)]
    if None in starts:
        return None
    start, rows = statistics.median(starts), []
    for tolerance in ("1e-8", "1e-5", "1e-3", "1e-2"):
        runs = [run(1, h, True, folder, more + [f"petsc.qs_ksp_rtol={tolerance}"], patience)
                for _ in range(repeat)]
        if None in runs:
            return None
        summary, seconds = runs[0][0], statistics.median(one[2] for one in runs)
        point_steps = summary["points"] * summary["steps_completed"]
        rows.append({
            "tolerance": tolerance, "points": summary["points"],
            "steps": summary["steps_completed"], "newton": summary["newton_iterations"]["total"],
            "linear": summary["linear_iterations"]["total"], "processor": seconds,
            "start": start, "per_point_and_step": (seconds - start) / point_steps,
        })
        print(f"work   {tolerance} {rows[-1]['newton']:3} newton {rows[-1]['linear']:4} linear "
              f"{seconds:.2f} s, {start:.2f} s of them the start: "
              f"{rows[-1]['per_point_and_step']:.3g} s per point and step", flush=True)
    return rows


def report(kind, rows):
    """What the table says in a few lines."""
    for ghost in (1, 0):
        mine = [row for row in rows if row["ghost"] == ghost and "linear" in row]
        failed = sum(row["ghost"] == ghost and "linear" not in row for row in rows)
        if not mine and not failed:
            continue
        counts = [row["per_solve"] for row in mine]
        spread = f"{min(counts):.1f} to {max(counts):.1f}" if counts else "none"
        print(f"{kind}, {'with' if ghost else 'without'} Ghost: {spread} linear iterations per "
              f"solve over {len(mine)} rows" + (f", {failed} failed" if failed else ""))
        if ghost and kind == "sizes" and len(mine) >= 3:
            share = lambda name: exponent([(row["points"] / row["ranks"], row[name])
                                           for row in mine])
            print(f"sizes: bytes of the busiest rank and step grow as (points per rank)^"
                  f"{share('bytes_max'):.2f}, the program's own ^{share('own_bytes_max'):.2f}; "
                  f"a surface is ^0.5 in the plane")
        for before, row in zip(mine, mine[1:]) if kind == "memory" else ():
            print(f"memory: {row['ranks']} ranks {row['memory_max'] / 1e6:.0f} MB, "
                  f"{row['memory_max'] / before['memory_max']:.2f} of {before['ranks']}")
        many = [row for row in mine if row["ranks"] >= 4]
        if ghost and kind == "strong" and len(many) >= 3:
            share = lambda name: exponent([(row["points"] / row["ranks"], row[name])
                                           for row in many])
            print(f"strong, 4 ranks and more: bytes of the busiest rank and step grow as "
                  f"(points per rank)^{share('bytes_max'):.2f}, of the average rank "
                  f"^{share('bytes_mean'):.2f}; the program's own ^{share('own_bytes_max'):.2f}; "
                  f"a surface is ^0.5 in the plane")


def main():
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("kind", choices=["strong", "weak", "sizes", "memory", "work", "all"])
    words.add_argument("--ranks", type=int, nargs="+")
    words.add_argument("--h", type=float, default=0.03125,
                       help="cell size, m: of strong; of weak on the largest rank count")
    words.add_argument("--out", help="tables and plots; docs/figures for all, else --work")
    words.add_argument("--work", help="runs (out/scaling/KIND)")
    words.add_argument("--repeat", type=int, default=3)
    words.add_argument("--bare", type=int, nargs="*", default=None,
                       help="rank counts that run without Ghost as well")
    words.add_argument("--patience", type=int, default=0, help="s after which a run is given up")
    words.add_argument("--resume", action="store_true")
    words.add_argument("--set", action="append", default=[], help="a key of the deck")
    words = words.parse_args()
    everything = words.kind == "all"
    folder = words.work or os.path.join(ROOT, "out/scaling", words.kind)
    out = words.out or (os.path.join(ROOT, "docs/figures") if everything else folder)
    os.makedirs(out, exist_ok=True)
    os.makedirs(folder, exist_ok=True)
    # On a cluster the batch system counts the cores.
    ranks = sorted(words.ranks or ([1, 2, 4, 8, 16, 32, 64] if everything else [1, 2]))
    limit = cores() if MACHINE == "local" else max(ranks)
    bare = words.bare if words.bare is not None else (ranks if everything else [])

    known, store = {}, os.path.join(folder, "rows.json")
    if words.resume and os.path.exists(store):
        with open(store) as file:
            known = json.load(file)

    def remember(path):
        with open(path, "w") as file:
            json.dump(known, file, indent=1)

    def measured(n, h, ghost):
        key = f"{n} {h!r} {int(ghost)} {words.set}"
        if key in known:
            return known[key]
        row = row_of(n, h, ghost, folder, words.repeat, words.set, limit, words.patience)
        if "linear" in row:
            known[key] = row
            publish(store, remember)
        return row

    plans = {
        "strong": [(n, words.h) for n in ranks],
        "weak": [(n, finer(words.h, n / ranks[-1])) for n in ranks],
        # 10^4 to 10^6 points on as many ranks as there are cores.
        "sizes": [(min(limit, 2), WIDTH / cells) for cells in (80, 160, 320, 480, 800)],
        "memory": [(n, WIDTH / 800) for n in (words.ranks if words.ranks and not everything
                                              else (1, 2, 4))],
    }
    place = lambda name: os.path.join(out, f"scaling-{name}")
    tables, failed = {}, []
    for kind, plan in plans.items():
        if words.kind not in (kind, "all"):
            continue
        rows = tables[kind] = []
        for ghost in (True, False):
            for n, h in plan:
                if not ghost and (kind == "memory" or not (
                        n in bare or (kind == "sizes" and words.bare != []))):
                    continue
                row = measured(n, h, ghost)
                rows.append(row)
                if "linear" in row:
                    time = f"{row['total']:9.3f} s" if "total" in row else "   (counts)"
                    print(f"{kind:6} {'ghost' if ghost else 'bare ':5} {n:5} ranks "
                          f"{row['points']:9} points {time} {row['newton']:4} newton "
                          f"{row['linear']:5} linear {row['messages_max']:9.0f} messages "
                          f"{row['bytes_max']:11.3g} bytes", flush=True)
        report(kind, rows)
        if any(row["ghost"] and "linear" not in row for row in rows):
            failed.append(kind)
            continue
        columns = ["ranks"] + COUNTS + ["total"] + PHASES
        publish(place(kind) + ".csv", lambda path: write_table(path, rows, columns))
        publish(place(kind) + ".svg", lambda path: write_plots(path, kind, rows))
    if words.kind in ("work", "all"):
        rows = work(folder, words.repeat, words.set, words.patience)
        if rows is None:
            failed.append("work")
        else:
            publish(place("work") + ".csv", lambda path: write_table(path, rows, list(rows[0])))
    if everything and not failed and sum(row["ranks"] >= 4 for row in tables["weak"]) > 2:
        found = model(tables["weak"], tables["sizes"], rows[0]["per_point_and_step"])
        publish(place("model") + ".csv", lambda path: write_model(path, found))
    if failed:
        sys.exit(f"failed, and no table written: {', '.join(failed)}")


if __name__ == "__main__":
    main()
