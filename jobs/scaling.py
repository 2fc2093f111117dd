#!/usr/bin/env python3
"""Strong, weak and size scaling of inputs/scaling.toml: tables (csv) and plots (svg).

scaling.py strong|weak|sizes|all [--ranks 1 2 4] [--h 0.03125] [--out docs/figures] [--repeat 3]

strong: one problem on more ranks. weak: as many points per rank, by finer cells. sizes: one rank
count, finer cells. Each with Ghost stabilisation and, where --bare asks for it, without.

Times are medians. On more ranks than the machine has cores a time says nothing about the
program: such rows keep their counts (messages, bytes, reductions, rows, iterations), and their
times are left empty. `all` runs each pair of ranks and cell size once and uses it wherever it is
needed; what it has measured is kept in --work, and --resume goes on from there. Needs Python's
standard library only.
"""
import argparse
import csv
import json
import math
import os
import re
import statistics
import subprocess
import sys

ROOT = os.environ.get("ROOT") or os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PROGRAM = os.environ.get("PROGRAM") or os.path.join(ROOT, "target/release/mpm-par")
MACHINE = os.environ.get("MACHINE", "local")
PHASES = ["setup", "locate", "assemble", "solve", "update", "migrate", "output"]
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


def run(ranks, h, ghost, out, more, patience):
    """One run; its summary and what the linear solver's log says, or None if it failed."""
    words = [PROGRAM, os.path.join(ROOT, "inputs/scaling.toml"), "--out", out, "--force"]
    settings = [f"grid.h={h!r}"] + ([] if ghost else ["ghost="]) + more
    for setting in settings:
        words += ["--set", setting]
    log = out + ".log_view"
    words += ["-log_view", ":" + log]
    script = '. "$ROOT/jobs/machines/$MACHINE.sh"; launch "$@"'
    env = dict(os.environ, ROOT=ROOT, MACHINE=MACHINE)
    for old in (log, os.path.join(out, "summary.json")):
        if os.path.exists(old):
            os.remove(old)
    start = ["timeout", str(patience)] if patience else []
    done = subprocess.run(start + ["bash", "-c", script, "bash", str(ranks)] + words, env=env,
                          stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if done.returncode:
        reason = [line for line in (done.stdout + done.stderr).splitlines() if "error:" in line]
        print(f"{ranks} ranks, h = {h:g}, Ghost {ghost}: exit code {done.returncode} "
              f"{reason[:1]}", flush=True)
        return None
    with open(os.path.join(out, "summary.json")) as file:
        summary = json.load(file)
    with open(log) as file:
        return summary, file.read()


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
    summary, log = runs[0]
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
            times = [summary["wall_seconds"][phase] for summary, _ in runs]
            row[phase] = statistics.median(times)
    return row


def exponent(pairs):
    """Slope of log y over log x by least squares."""
    pairs = [(math.log(x), math.log(y)) for x, y in pairs if x > 0 and y > 0]
    if len(pairs) < 2:
        return float("nan")
    mx, my = (sum(p[k] for p in pairs) / len(pairs) for k in (0, 1))
    return sum((x - mx) * (y - my) for x, y in pairs) / sum((x - mx) ** 2 for x, _ in pairs)


def write_table(path, rows):
    with open(path, "w", newline="") as file:
        table = csv.DictWriter(file, ["ranks"] + COUNTS + ["total"] + PHASES, restval="")
        table.writeheader()
        for row in rows:
            table.writerow({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()})


class Plot:
    """A plot of lines over rank counts or sizes on logarithmic axes, or of stacked shares."""

    WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 420, 260, 64, 84, 30, 44
    COLOURS = ["#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#8c564b", "#17becf"]

    def __init__(self, title, ranks, axis="ranks"):
        self.title, self.ranks, self.axis = title, ranks, axis
        self.parts, self.legend = [], []

    def x(self, ranks):
        first, last = min(self.ranks), max(max(self.ranks), min(self.ranks) * 2)
        share = _log(ranks / first) / _log(last / first)
        return self.LEFT + share * (self.WIDTH - self.LEFT - self.RIGHT)

    def y(self, share):
        return self.HEIGHT - self.BOTTOM - share * (self.HEIGHT - self.TOP - self.BOTTOM)

    def lines(self, series):
        """series: {name: [(ranks, value)]}, positive values."""
        values = [v for points in series.values() for _, v in points if v > 0]
        if not values:
            return self.note("nothing to show")
        low, high = min(values), max(values)
        if high < 1.5 * low:
            low, high = low / 1.3, high * 1.3
        place = lambda v: self.y(_log(v / low) / _log(high / low))
        for value in (low, (low * high) ** 0.5, high):
            self.parts.append(
                f'<line x1="{self.LEFT}" x2="{self.WIDTH - self.RIGHT}" y1="{place(value):.1f}" '
                f'y2="{place(value):.1f}" stroke="#ddd"/><text x="{self.LEFT - 6}" '
                f'y="{place(value) + 4:.1f}" text-anchor="end">{value:.3g}</text>')
        for k, (name, points) in enumerate(series.items()):
            colour = self.COLOURS[k % len(self.COLOURS)]
            points = [(self.x(r), place(v)) for r, v in points if v > 0]
            path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
            self.parts.append(f'<polyline points="{path}" fill="none" stroke="{colour}" '
                              f'stroke-width="1.5"/>')
            self.parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5" fill="{colour}"/>'
                           for x, y in points]
            self.legend.append((name, colour))
        return self

    def shares(self, rows, names):
        for row in rows:
            below, total = 0.0, sum(row[name] for name in names) or 1.0
            for k, name in enumerate(names):
                share = row[name] / total
                self.parts.append(
                    f'<rect x="{self.x(row[self.axis]) - 8:.1f}" y="{self.y(below + share):.1f}" '
                    f'width="16" height="{self.y(below) - self.y(below + share):.1f}" '
                    f'fill="{self.COLOURS[k]}"/>')
                below += share
        self.legend += list(zip(names, self.COLOURS))
        return self

    def note(self, text):
        self.parts.append(f'<text x="{self.WIDTH / 2}" y="{self.HEIGHT / 2}" '
                          f'text-anchor="middle">{text}</text>')
        return self

    def svg(self, left, top):
        body = [f'<g transform="translate({left},{top})">',
                f'<text x="{self.WIDTH / 2}" y="16" text-anchor="middle" '
                f'font-weight="bold">{self.title}</text>']
        body += self.parts
        for ranks in self.ranks:
            body.append(f'<text x="{self.x(ranks):.1f}" y="{self.HEIGHT - self.BOTTOM + 16}" '
                        f'text-anchor="middle">{ranks:.3g}</text>')
        body.append(f'<text x="{self.WIDTH / 2}" y="{self.HEIGHT - 12}" '
                    f'text-anchor="middle">{self.axis}</text>')
        for k, (name, colour) in enumerate(self.legend):
            y = self.TOP + 10 + 13 * k
            body.append(f'<text x="{self.WIDTH - self.RIGHT + 10}" y="{y}" '
                        f'fill="{colour}">{name}</text>')
        return "\n".join(body + ["</g>"])


def _log(value):
    return math.log(value) if value > 0 else 0.0


def write_plots(path, kind, rows):
    """Of the rows that did not fail; without Ghost only their iterations."""
    bare = [row for row in rows if not row["ghost"] and "linear" in row]
    rows = [row for row in rows if row["ghost"] and "linear" in row]
    if not rows:
        return
    key = "points" if kind == "sizes" else "ranks"
    places = [row[key] for row in rows]
    timed = [row for row in rows if "total" in row]
    plot = lambda title: Plot(title, places, key)
    over = lambda name, rows=rows: [(row[key], row[name]) for row in rows]
    plots = []
    if timed and kind != "sizes":
        first = timed[0]
        work = lambda row: row["points"] / first["points"]
        plots.append(plot("speed over the first row").lines({
            "measured": [(row[key], first["total"] / row["total"] * work(row)) for row in timed],
            "ideal": [(row[key], row[key] / first[key]) for row in timed],
        }))
    if timed:
        plots.append(plot("share of the phases").shares(timed, PHASES))
    iterations = {"with Ghost": over("per_solve")}
    if bare:
        iterations["without"] = over("per_solve", bare)
    plots.append(plot("linear iterations per solve").lines(iterations))
    if kind != "sizes":
        plots.append(plot("messages per rank and step").lines(
            {"largest": over("messages_max"), "mean": over("messages_mean")}))
        plots.append(plot("bytes per rank and step").lines(
            {"largest": over("bytes_max"), "mean": over("bytes_mean")}))
        plots.append(plot("reductions per step").lines({"": over("reductions")}))
    plots.append(plot("memory of the largest rank, bytes").lines({"": over("memory_max")}))
    columns = 2
    height = Plot.HEIGHT * -(-len(plots) // columns) + 40
    with open(path, "w") as file:
        file.write(f'<svg xmlns="http://www.w3.org/2000/svg" width="{Plot.WIDTH * columns}" '
                   f'height="{height}" font-family="sans-serif" font-size="11">\n'
                   f'<rect width="100%" height="100%" fill="white"/>\n'
                   f'<text x="{Plot.WIDTH}" y="24" text-anchor="middle" font-size="14">'
                   f'{kind}: inputs/scaling.toml</text>\n')
        for k, one in enumerate(plots):
            file.write(one.svg(Plot.WIDTH * (k % columns), 36 + Plot.HEIGHT * (k // columns)))
            file.write("\n")
        file.write("</svg>\n")


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
        many = [row for row in mine if row["ranks"] >= 4]
        if ghost and kind == "strong" and len(many) >= 3:
            share = lambda name: exponent([(row["points"] / row["ranks"], row[name])
                                           for row in many])
            print(f"strong, 4 ranks and more: bytes of the busiest rank and step grow as "
                  f"(points per rank)^{share('bytes_max'):.2f}, of the average rank "
                  f"^{share('bytes_mean'):.2f}; the program's own ^{share('own_bytes_max'):.2f}; "
                  f"a surface is ^0.5 in the plane")


# Assumed of a large machine: s per message, bytes per s and rank, s per reduction and doubling.
LATENCY, BANDWIDTH, REDUCTION = 2e-6, 1e9, 2e-6
# Processor seconds per point and step of this deck on one rank (docs/scaling.md).
PER_POINT = 3.1e-6


def model(weak, sizes):
    """What the counts say of rank counts that nobody has here."""
    rows = [row for row in weak if row["ghost"] and row["ranks"] >= 4 and "linear" in row]
    seen = rows[-1]

    def grown(name, ranks):
        """At the weak series' points per rank: linear in log2 of the ranks, and never less than on
        the most ranks counted."""
        pairs = [(math.log2(row["ranks"]), row[name]) for row in rows]
        mx, my = (sum(p[k] for p in pairs) / len(pairs) for k in (0, 1))
        slope = (sum((x - mx) * (y - my) for x, y in pairs)
                 / sum((x - mx) ** 2 for x, _ in pairs))
        return max(my + slope * (math.log2(ranks) - mx), seen[name])

    def power(name):
        return exponent([(row["points"], row[name]) for row in sizes
                         if row["ghost"] and "linear" in row])

    print("| ranks | points per rank | messages | MB | reductions | work s | messages s | "
          "bytes s | reductions s | efficiency |\n" + "|---" * 10 + "|")
    for ranks in (64, 1000, 10_000, 100_000):
        for points in (20_000, 50_000, 200_000):
            larger = points / (seen["points"] / seen["ranks"])
            messages = grown("messages_max", ranks) * larger ** power("messages_max")
            size = grown("bytes_max", ranks) * larger ** power("bytes_max")
            reductions = grown("reductions", ranks) * larger ** power("reductions")
            work = PER_POINT * points
            parts = (messages * LATENCY, size / BANDWIDTH,
                     reductions * REDUCTION * math.log2(ranks))
            print(f"| {ranks} | {points} | {messages:.0f} | {size / 1e6:.1f} | {reductions:.0f} | "
                  f"{work:.2f} | {parts[0]:.3f} | {parts[1]:.3f} | {parts[2]:.3f} | "
                  f"{100 * work / (work + sum(parts)):.0f} % |")


def main():
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("kind", choices=["strong", "weak", "sizes", "all"])
    words.add_argument("--ranks", type=int, nargs="+")
    words.add_argument("--h", type=float, default=0.03125,
                       help="cell size, m: of strong; of weak on the largest rank count")
    words.add_argument("--out", help="tables and plots; docs/figures for all")
    words.add_argument("--work", default=os.path.join(ROOT, "out/scaling"))
    words.add_argument("--repeat", type=int, default=3)
    words.add_argument("--bare", type=int, nargs="*", default=None,
                       help="rank counts that run without Ghost as well")
    words.add_argument("--patience", type=int, default=0, help="s after which a run is given up")
    words.add_argument("--resume", action="store_true")
    words.add_argument("--set", action="append", default=[], help="a key of the deck")
    words = words.parse_args()
    everything = words.kind == "all"
    out = words.out or (os.path.join(ROOT, "docs/figures") if everything else words.work)
    os.makedirs(out, exist_ok=True)
    os.makedirs(words.work, exist_ok=True)
    # On a cluster the batch system counts the cores.
    ranks = sorted(words.ranks or ([1, 2, 4, 8, 16, 32, 64] if everything else [1, 2]))
    limit = cores() if MACHINE == "local" else max(ranks)
    bare = words.bare if words.bare is not None else ([1, 2, 4, 16] if everything else [])

    known, store = {}, os.path.join(words.work, "rows.json")
    if words.resume and os.path.exists(store):
        with open(store) as file:
            known = json.load(file)

    def measured(n, h, ghost):
        key = f"{n} {h!r} {int(ghost)} {words.set}"
        if key not in known:
            known[key] = row_of(n, h, ghost, words.work, words.repeat, words.set, limit,
                                words.patience)
            with open(store, "w") as file:
                json.dump(known, file, indent=1)
        return known[key]

    weak_h = {n: finer(words.h, n / ranks[-1]) for n in ranks}
    # 10^4 to 10^6 points on as many ranks as there are cores.
    sizes = [(min(limit, 2), WIDTH / cells) for cells in (80, 160, 320, 480, 800)]
    plans = {"strong": [(n, words.h) for n in ranks], "weak": [(n, weak_h[n]) for n in ranks],
             "sizes": sizes}
    tables = {}
    for kind, plan in plans.items():
        if words.kind not in (kind, "all"):
            continue
        rows = tables[kind] = []
        for ghost in (True, False):
            for n, h in plan:
                if not ghost and not (n in bare or (kind == "sizes" and words.bare != [])):
                    continue
                row = measured(n, h, ghost)
                rows.append(row)
                if "linear" in row:
                    time = f"{row['total']:9.3f} s" if "total" in row else "   (counts)"
                    print(f"{kind:6} {'ghost' if ghost else 'bare ':5} {n:5} ranks "
                          f"{row['points']:9} points {time} {row['newton']:4} newton "
                          f"{row['linear']:5} linear {row['messages_max']:9.0f} messages "
                          f"{row['bytes_max']:11.3g} bytes", flush=True)
                write_table(os.path.join(out, f"scaling-{kind}.csv"), rows)
        write_plots(os.path.join(out, f"scaling-{kind}.svg"), kind, rows)
        report(kind, rows)
    if everything and sum(row["ranks"] >= 4 for row in tables["weak"]) > 2:
        model(tables["weak"], tables["sizes"])


if __name__ == "__main__":
    main()
