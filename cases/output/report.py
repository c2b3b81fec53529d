"""A run as one HTML file: made by a program of the client, kept in the run's folder by a server."""

import importlib.util

PROGRAM = "conoid.client.reports"
"""The program: ``python -m conoid.client.reports FOLDER OUT``, one run a process."""
NAME = "report.html"
"""Name of the report in the folder of a run."""


_NEEDS = "conoid.client", "h5py", "matplotlib", "pyvista"


def missing() -> list[str]:
    """Returns the names of the packages that the program needs and that are missing here; empty if the program can
    be started."""
    return [name for name in _NEEDS if importlib.util.find_spec(name) is None]
