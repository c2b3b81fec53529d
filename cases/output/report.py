"""Report of a run as one HTML file: a program of the client makes the file, and a server stores it in the run's
folder."""

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
