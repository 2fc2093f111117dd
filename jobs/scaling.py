#!/usr/bin/env python3
"""Strong and weak scaling of inputs/scaling.toml: tables (csv) and plots (svg).

scaling.py strong|weak --ranks 1 2 4 [--h 0.125] [--out out/scaling] [--repeat 3]

Times are medians. On more ranks than the machine has cores a time says nothing about the
program: such rows keep their counts (messages, bytes, reductions, rows, iterations), and their
times are left empty. Needs Python's standard library only.
"""
import argparse
import csv
import json
import os
import re
import statistics
import subprocess
import sys

ROOT = os.environ.get("ROOT") or os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PROGRAM = os.environ.get("PROGRAM") or os.path.join(ROOT, "target/release/mpm-par")
MACHINE = os.environ.get("MACHINE", "local")
PHASES = ["setup", "locate", "assemble", "solve", "update", "migrate", "output"]
COUNTS = ["points", "steps", "newton", "linear", "messages_max", "messages_mean", "bytes_max",
          "bytes_mean", "reductions", "memory_max", "imbalance"]


def cores():
    """Physical cores that this process may use."""
    found = subprocess.run(["lscpu", "--parse=CORE,SOCKET"], capture_output=True, text=True)
    lines = {line for line in found.stdout.splitlines() if not line.startswith("#")}
    return min(len(lines) or 1, len(os.sched_getaffinity(0)))


def sizes(kind, ranks, h):
    """--set words for this rank count. Weak: the block is as many times wider as ranks."""
    if kind == "strong":
        return [f"grid.h={h}"]
    width = 4 * ranks
    return [f"grid.h={h}", f"grid.size=[{width + 1}.0, 5.0]",
            f"body.0.shape={{ box = {{ min = [0, 0], max = [{width}, 4] }} }}"]


def run(kind, ranks, h, out, more):
    """One run; its summary and what the linear solver's log says about messages."""
    words = [PROGRAM, os.path.join(ROOT, "inputs/scaling.toml"), "--out", out, "--force"]
    for size in sizes(kind, ranks, h) + more:
        words += ["--set", size]
    log = out + ".log_view"
    words += ["-log_view", ":" + log]
    script = '. "$ROOT/jobs/machines/$MACHINE.sh"; launch "$@"'
    env = dict(os.environ, ROOT=ROOT, MACHINE=MACHINE)
    done = subprocess.run(["bash", "-c", script, "bash", str(ranks)] + words, env=env,
                          stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{ranks} ranks failed:\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}")
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


def row_of(kind, ranks, h, out, repeat, more, limit):
    """A table row: counts of the first run, medians of the times of all."""
    runs = [run(kind, ranks, h, os.path.join(out, f"{kind}-{ranks}"), more)
            for _ in range(repeat if ranks <= limit else 1)]
    summary, log = runs[0]
    steps = summary["steps_completed"]
    # PETSc counts its own messages and bytes; those of the program itself come on top.
    own = summary.get("communication", {})
    messages = logged(log, "MPI Msg Count")
    length = re.search(r"^MPI Msg Len \(bytes\):\s+(\S+)\s+\S+\s+\S+\s+(\S+)", log, re.M)
    bytes_ = (float(length.group(1)), float(length.group(2)) / ranks) if length else (0.0, 0.0)
    reductions = logged(log, "MPI Reductions")
    add = lambda key: own.get(key, 0.0)
    row = {
        "ranks": ranks,
        "points": summary["points"],
        "steps": steps,
        "newton": summary["newton_iterations"]["total"],
        "linear": summary["linear_iterations"]["total"],
        "messages_max": messages[0] / steps + add("messages_max"),
        "messages_mean": messages[1] / steps + add("messages_mean"),
        "bytes_max": bytes_[0] / steps + add("bytes_max"),
        "bytes_mean": bytes_[1] / steps + add("bytes_mean"),
        "reductions": reductions[0] / steps + add("reductions"),
        "memory_max": summary["peak_memory_bytes"]["max"],
        "imbalance": summary["imbalance"],
    }
    if ranks <= limit:
        for phase in ["total"] + PHASES:
            times = [summary["wall_seconds"][phase] for summary, _ in runs]
            row[phase] = statistics.median(times)
    return row


def write_table(path, rows):
    with open(path, "w", newline="") as file:
        table = csv.DictWriter(file, ["ranks"] + COUNTS + ["total"] + PHASES, restval="")
        table.writeheader()
        for row in rows:
            table.writerow({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()})


class Plot:
    """A plot of lines over rank counts on logarithmic axes, or of stacked shares."""

    WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 360, 260, 64, 16, 30, 44
    COLOURS = ["#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#8c564b", "#17becf"]

    def __init__(self, title, ranks):
        self.title, self.ranks = title, ranks
        self.parts, self.legend = [], []

    def x(self, ranks):
        first, last = self.ranks[0], max(self.ranks[-1], self.ranks[0] * 2)
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
                    f'<rect x="{self.x(row["ranks"]) - 8:.1f}" y="{self.y(below + share):.1f}" '
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
                        f'text-anchor="middle">{ranks}</text>')
        body.append(f'<text x="{self.WIDTH / 2}" y="{self.HEIGHT - 12}" '
                    f'text-anchor="middle">ranks</text>')
        for k, (name, colour) in enumerate(self.legend):
            y = self.TOP + 10 + 13 * k
            body.append(f'<text x="{self.WIDTH - self.RIGHT - 4}" y="{y}" text-anchor="end" '
                        f'fill="{colour}">{name}</text>')
        return "\n".join(body + ["</g>"])


def _log(value):
    import math
    return math.log(value) if value > 0 else 0.0


def write_plots(path, kind, rows):
    ranks = [row["ranks"] for row in rows]
    timed = [row for row in rows if "total" in row]
    plot = lambda title: Plot(title, ranks)
    per_rank = lambda key: [(row["ranks"], row[key]) for row in rows]
    plots = []
    if timed:
        first = timed[0]
        speed = lambda row: first["total"] / row["total"] * (row["ranks"] / first["ranks"]
                                                             if kind == "weak" else 1.0)
        plots.append(plot("speed over the first row").lines({
            "measured": [(row["ranks"], speed(row)) for row in timed],
            "ideal": [(row["ranks"], row["ranks"] / first["ranks"]) for row in timed],
        }))
        plots.append(plot("share of the phases").shares(timed, PHASES))
    plots.append(plot("iterations per step").lines({
        "newton": [(row["ranks"], row["newton"] / row["steps"]) for row in rows],
        "linear": [(row["ranks"], row["linear"] / row["steps"]) for row in rows]}))
    plots.append(plot("messages per rank and step").lines(
        {"largest": per_rank("messages_max"), "mean": per_rank("messages_mean")}))
    plots.append(plot("bytes per rank and step").lines(
        {"largest": per_rank("bytes_max"), "mean": per_rank("bytes_mean")}))
    plots.append(plot("memory of the largest rank, bytes").lines({"": per_rank("memory_max")}))
    columns = 2
    height = Plot.HEIGHT * -(-len(plots) // columns) + 40
    with open(path, "w") as file:
        file.write(f'<svg xmlns="http://www.w3.org/2000/svg" width="{Plot.WIDTH * columns}" '
                   f'height="{height}" font-family="sans-serif" font-size="11">\n'
                   f'<rect width="100%" height="100%" fill="white"/>\n'
                   f'<text x="{Plot.WIDTH}" y="24" text-anchor="middle" font-size="14">'
                   f'{kind} scaling of inputs/scaling.toml</text>\n')
        for k, one in enumerate(plots):
            file.write(one.svg(Plot.WIDTH * (k % columns), 36 + Plot.HEIGHT * (k // columns)))
            file.write("\n")
        file.write("</svg>\n")


def main():
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("kind", choices=["strong", "weak"])
    words.add_argument("--ranks", type=int, nargs="+", default=[1, 2])
    words.add_argument("--h", default="0.125", help="cell size, m")
    words.add_argument("--out", default=os.path.join(ROOT, "out/scaling"))
    words.add_argument("--repeat", type=int, default=1)
    words.add_argument("--set", action="append", default=[], help="a key of the deck")
    words = words.parse_args()
    os.makedirs(words.out, exist_ok=True)
    # On a cluster the batch system counts the cores.
    limit = cores() if MACHINE == "local" else max(words.ranks)
    rows = []
    for ranks in sorted(words.ranks):
        row = row_of(words.kind, ranks, words.h, words.out, words.repeat, words.set, limit)
        rows.append(row)
        time = f"{row['total']:9.3f} s" if "total" in row else "   (counts)"
        print(f"{words.kind:6} {ranks:5} ranks {row['points']:9} points {time} "
              f"{row['newton']:4} newton {row['linear']:5} linear "
              f"{row['messages_max']:9.0f} messages {row['bytes_max']:11.3g} bytes", flush=True)
        write_table(os.path.join(words.out, f"{words.kind}.csv"), rows)
    write_plots(os.path.join(words.out, f"{words.kind}.svg"), words.kind, rows)


if __name__ == "__main__":
    main()
