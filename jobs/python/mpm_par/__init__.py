"""Results of mpm-par in Python: open a run, read its tables and points, plot, sweep over deck keys.

Only numpy and h5py are needed; matplotlib draws pictures, pandas gives data frames.
"""
from .run import Frame, Run, open_run
from .sweep import sweep
from .table import Table

open = open_run
__all__ = ["Frame", "Run", "Table", "open", "open_run", "sweep"]
__version__ = "0.1.0"
