"""Tables of a results directory: history.csv, probes.csv, residuals.csv, element.csv."""
import csv
import re

import numpy as np


class Table:
    """Columns by their names without units; `units` has the units."""

    def __init__(self, names, units, columns):
        self.names = names
        self.units = dict(zip(names, units))
        self._columns = dict(zip(names, columns))

    @classmethod
    def read(cls, path):
        with open(path, newline="") as file:
            text = file.read()
        # A run that goes on may have written half of its last row.
        rows = csv.reader(text[: text.rfind("\n") + 1].splitlines())
        header = next(rows)
        numbers = [row for row in rows if len(row) == len(header)]
        titles = [re.fullmatch(r"(.*) \[(.*)\]", title) for title in header]
        names = [found.group(1) if found else title for found, title in zip(titles, header)]
        units = [found.group(2) if found else "" for found in titles]
        values = np.array(numbers, dtype=float).reshape(len(numbers), len(header))
        return cls(names, units, values.T)

    def __getitem__(self, name):
        try:
            return self._columns[name]
        except KeyError:
            raise KeyError(f"no column {name!r}; there are {', '.join(self.names)}") from None

    def __contains__(self, name):
        return name in self._columns

    def __len__(self):
        return len(next(iter(self._columns.values()), ()))

    def frame(self):
        """The table as a pandas.DataFrame."""
        import pandas

        return pandas.DataFrame(self._columns)
