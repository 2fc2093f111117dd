"""A results directory and the points of its frames."""
import json
import os
import re

import h5py
import numpy as np

from .table import Table

COMPONENTS = {
    3: ["x", "y", "z"],
    6: ["xx", "xy", "xz", "yy", "yz", "zz"],
    9: ["xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"],
}
PRINCIPAL = ["1", "2", "3"]


def open_run(directory):
    """The run that has written `directory`, finished or not."""
    return Run(directory)


class Frame:
    """The points at the end of a step; rows in the order of their ids."""

    def __init__(self, path):
        self.path = path
        with h5py.File(path, "r") as file:
            self.step = int(file.attrs["step"])
            self.time = float(file.attrs["time"])
            self.id = file["id"][:]
            self.names = [
                name
                for name in file
                if name not in ("vertices", "position") and not name.startswith("domain_")
            ]
            self.units = {name: _text(file[name].attrs.get("unit", "")) for name in file}
        self._order = np.argsort(self.id, kind="stable")
        self.id = self.id[self._order]
        self._read = {}

    def __getitem__(self, name):
        """All numbers of a field: an array of points, or of points by components."""
        if name not in self._read:
            with h5py.File(self.path, "r") as file:
                if name not in file:
                    raise KeyError(f"no field {name!r}; there are {', '.join(self.names)}")
                # In the order of the file, which is read fastest, then sorted.
                self._read[name] = file[name][:][self._order]
        return self._read[name]

    def __len__(self):
        return len(self.id)

    @property
    def position(self):
        """x, y, z of each point, m."""
        return self["position"]

    def component(self, selector):
        """One number at each point: `J`, `stress.yy`, `|displacement|`."""
        if selector.startswith("|"):
            return np.linalg.norm(self[selector.strip("|")], axis=1)
        name, _, part = selector.partition(".")
        values = self[name]
        if values.ndim == 2 and values.shape[1] == 3 and not part and not name.startswith("principal"):
            # A vector's own name means its length, as in mpm-par plot.
            return np.linalg.norm(values, axis=1)
        if values.ndim == 1:
            if part:
                raise KeyError(f"{name} is one number and has no component {part!r}")
            return values
        known = PRINCIPAL if name.startswith("principal") else COMPONENTS[values.shape[1]]
        if part not in known:
            raise KeyError(f"{name} has the components {', '.join(known)}, not {part!r}")
        return values[:, known.index(part)]

    @property
    def corners(self):
        """Corners of each point's domain, m: points by corners by x, y, z; None with the basis mpm."""
        with h5py.File(self.path, "r") as file:
            if "domain_corners" not in file:
                return None
            corners = file["domain_corners"][:]
        return corners.reshape(len(self), -1, 3)[self._order]

    def cloud(self):
        """The points with all fields as a pyvista.PolyData."""
        import pyvista

        cloud = pyvista.PolyData(self.position)
        for name in self.names:
            cloud.point_data[name] = self[name]
        return cloud

    def domains(self):
        """The points' domains with all fields as a pyvista.UnstructuredGrid; None with the basis mpm."""
        import pyvista

        corners = self.corners
        if corners is None:
            return None
        count, each, _ = corners.shape
        kind = {4: pyvista.CellType.QUAD, 8: pyvista.CellType.HEXAHEDRON}[each]
        numbers = np.arange(count * each).reshape(count, each)
        cells = np.hstack([np.full((count, 1), each), numbers])
        grid = pyvista.UnstructuredGrid(cells, np.full(count, kind), corners.reshape(-1, 3))
        for name in self.names:
            grid.cell_data[name] = self[name]
        return grid

    def unit(self, selector):
        return self.units.get(selector.strip("|").split(".")[0], "")


class Run:
    """A results directory."""

    def __init__(self, directory):
        self.directory = os.fspath(directory)
        if not os.path.isdir(self.directory):
            raise FileNotFoundError(f"{self.directory} is no results directory")
        self._tables = {}

    def _path(self, name):
        return os.path.join(self.directory, name)

    @property
    def summary(self):
        """summary.json; None while the run goes on."""
        if not os.path.exists(self._path("summary.json")):
            return None
        with open(self._path("summary.json")) as file:
            return json.load(file)

    @property
    def status(self):
        """completed, stopped or failed; running (or killed) without a summary."""
        summary = self.summary
        return summary["status"] if summary else "running"

    @property
    def deck(self):
        """The text of resolved.toml."""
        with open(self._path("resolved.toml")) as file:
            return file.read()

    def table(self, name):
        """history, probes, residuals or element, as it is on the disk now."""
        return Table.read(self._path(f"{name}.csv"))

    @property
    def history(self):
        return self.table("history")

    @property
    def probes(self):
        return self.table("probes")

    @property
    def steps(self):
        """Steps that have a frame."""
        found = (re.fullmatch(r"points-(\d+)\.h5", name) for name in os.listdir(self.directory))
        return sorted(int(match.group(1)) for match in found if match)

    @property
    def fields(self):
        return self.points(-1).names

    def points(self, step=-1):
        """The points of a step; -1 is the last that is written, -2 the one before."""
        steps = self.steps
        if step < 0:
            if len(steps) < -step:
                raise IndexError(f"{self.directory} has {len(steps)} frames")
            step = steps[step]
        if step not in steps:
            raise KeyError(f"no frame of step {step}; there are {steps}")
        return Frame(self._path(f"points-{step:06d}.h5"))

    def section(self, start, end, selector, step=-1, width=None):
        """Values along a line: distance from `start` (m) and values of the points within `width`
        of it (by default the median distance between neighbours), in the order of the distance."""
        frame = self.points(step)
        values = frame.component(selector)
        a, b = (np.resize(np.append(np.asarray(x, float), [0.0] * 3), 3) for x in (start, end))
        along = (b - a) / np.linalg.norm(b - a)
        reach = frame.position - a
        distance = reach @ along
        aside = np.linalg.norm(reach - np.outer(distance, along), axis=1)
        if width is None:
            width = spacing(frame.position)
        near = (aside <= width) & (distance >= -width) & (distance <= np.linalg.norm(b - a) + width)
        order = np.argsort(distance[near], kind="stable")
        return distance[near][order], values[near][order]

    def plot(self, selector, step=-1, save=None, axes=None, domains=False):
        """Points coloured by a field, from the front (x across, the last axis up); with `domains` in
        the plane the domains of the points. `save`: a file (png, svg, pdf). Returns the axes."""
        import matplotlib

        if save and axes is None:
            matplotlib.use("Agg")
        import matplotlib.pyplot as plt

        frame = self.points(step)
        x, y, upward = frame.position[:, 0], frame.position[:, 1], "y"
        if np.any(frame.position[:, 2] != 0.0):
            y, upward = frame.position[:, 2], "z"
        if axes is None:
            _, axes = plt.subplots(layout="constrained")
        corners = frame.corners if domains else None
        if domains and (corners is None or corners.shape[1] != 4):
            raise ValueError("domains are drawn in the plane, and mpm has none: frame.domains() is for pyvista")
        size = max((spacing(frame.position) / max(np.ptp(x), np.ptp(y), 1e-300) * 400) ** 2, 1.0)
        if corners is None:
            values = frame.component(selector)
            drawn = axes.scatter(x, y, c=values, s=size, marker="s", linewidths=0)
        else:
            from matplotlib.collections import PolyCollection

            drawn = PolyCollection(corners[:, :, :2], edgecolors="#0006", linewidths=0.4)
            drawn.set_array(frame.component(selector))
            axes.add_collection(drawn)
            axes.autoscale_view()
        axes.set_aspect("equal")
        axes.set_xlabel("x [m]")
        axes.set_ylabel(f"{upward} [m]")
        axes.set_title(f"step {frame.step}")
        axes.figure.colorbar(drawn, ax=axes, label=f"{selector} [{frame.unit(selector)}]")
        if save:
            axes.figure.savefig(save, dpi=150, bbox_inches="tight")
            plt.close(axes.figure)
        return axes


def spacing(position):
    """Median distance to the nearest neighbour, of 40 points."""
    some = position[:: max(len(position) // 40, 1)]
    nearest = []
    for x in some:
        square = np.sum((position - x) ** 2, axis=1)
        square = square[square > 0.0]
        if len(square):
            nearest.append(np.sqrt(square.min()))
    return float(np.median(nearest)) if nearest else 0.0


def _text(value):
    return value.decode() if isinstance(value, bytes) else str(value)
