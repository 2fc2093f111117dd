"""The plots (svg) of scaling.py, with Python's standard library only."""
import math

PHASES = ["setup", "locate", "assemble", "solve", "update", "migrate", "output"]


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
