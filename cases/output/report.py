"""The report of a run: one HTML file. A program of the client makes it, and a server stores it in the folder of the
run.
"""

import importlib.util

PROGRAM = "conoid.client.reports"
"""Module of the program that makes a report: ``python -m conoid.client.reports FOLDER OUT``, one process for each run.
"""
NAME = "report.html"
"""Name of the report in the folder of a run."""


_NEEDS = "conoid.client", "h5py", "matplotlib", "pyvista"


def missing() -> list[str]:
    """Returns the names of the missing packages that the report program needs; empty if the program can be started."""
    return [name for name in _NEEDS if importlib.util.find_spec(name) is None]
