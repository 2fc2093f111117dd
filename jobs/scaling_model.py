"""What the counts of scaling.py say of rank counts that nobody has here (docs/evidence/scaling.md)."""
import csv
import math


def exponent(pairs):
    """Slope of log y over log x by least squares."""
    pairs = [(math.log(x), math.log(y)) for x, y in pairs if x > 0 and y > 0]
    if len(pairs) < 2:
        return float("nan")
    mx, my = (sum(p[k] for p in pairs) / len(pairs) for k in (0, 1))
    return sum((x - mx) * (y - my) for x, y in pairs) / sum((x - mx) ** 2 for x, _ in pairs)


# Assumed of a large machine: s per message, bytes per s and rank, s per reduction and doubling.
LATENCY, BANDWIDTH, REDUCTION = 2e-6, 1e9, 2e-6
COLUMNS = ["ranks", "points per rank", "messages", "MB", "reductions", "work s", "messages s",
           "bytes s", "reductions s", "efficiency"]


def model(weak, sizes, per_point):
    """Rows of COLUMNS; per_point: processor seconds per point and step on one rank."""
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

    found = []
    for ranks in (64, 1000, 10_000, 100_000):
        for points in (20_000, 50_000, 200_000):
            larger = points / (seen["points"] / seen["ranks"])
            messages = grown("messages_max", ranks) * larger ** power("messages_max")
            size = grown("bytes_max", ranks) * larger ** power("bytes_max")
            reductions = grown("reductions", ranks) * larger ** power("reductions")
            work = per_point * points
            parts = (messages * LATENCY, size / BANDWIDTH,
                     reductions * REDUCTION * math.log2(ranks))
            found.append([ranks, points, f"{messages:.0f}", f"{size / 1e6:.1f}",
                          f"{reductions:.0f}", f"{work:.2f}", *(f"{part:.3f}" for part in parts),
                          f"{100 * work / (work + sum(parts)):.0f} %"])
    return found


def write_model(path, rows):
    """As csv to `path`, and as the table of docs/evidence/scaling.md to the terminal."""
    with open(path, "w", newline="") as file:
        csv.writer(file).writerows([COLUMNS] + rows)
    print(f"| {' | '.join(COLUMNS)} |\n" + "|---" * len(COLUMNS) + "|")
    for row in rows:
        print(f"| {' | '.join(str(cell) for cell in row)} |")
