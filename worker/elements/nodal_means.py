"""Arrays of the averaged pressure forms: sums and means with one row for each material of a node."""

import numpy as np

from ..model.growing import extended
from ..model.state import Floats, Ints
from . import matter
from .passes import Values

_STORED = {"_weight": "weight", "pressure": "pressure", "_projected": "projected", "_matter": "matter"}
"""Names of the stored columns in a checkpoint, with the names of their attributes."""


class NodalMeans:
    """Sums and means of a rank. ``fields`` is the record that kernels take as argument (records.Means)."""

    def __init__(self, weight: Floats, bulk: Floats, columns: int, *, split: bool, pressed: bool) -> None:
        """``weight`` (rows,): 1 / reference volume, 1/m^3; ``bulk`` (rows,): bulk modulus, Pa; ``columns``: number of
        columns of the sums; ``split``: True if pressure gradients stabilise the volume strain; ``pressed``: True if
        there are nodal pressures.
        """
        n, of_split = len(weight), len(weight) if split else 1
        self.weight, self.bulk, self.split, self.pressed = weight, bulk, split, pressed
        self.sums: Ints = np.zeros((n, columns), np.int64)
        self.strain, self.more = np.zeros(n), np.zeros(n)
        self.pressure, self.projected = np.zeros(of_split), np.zeros((of_split, 3))
        self.gradient: Ints = np.zeros((of_split, 3), np.int64)
        self.volumes = np.zeros(of_split)
        """(rows,) nodal volumes of the step, m^3. If the form is not ``split``, the array has one row."""
        self.matter = matter.at_start(n if pressed else 1)

    @property
    def n(self) -> int:
        """Number of rows."""
        return len(self.strain)

    @property
    def fields(self) -> Values:
        """Returns the fields for records.Means."""
        return (
            self.sums, self.weight, self.strain, self.more, self.split, self.pressure, self.projected, self.gradient,
            self.matter,
        )  # fmt: skip

    def grow(self, parents: Ints) -> None:
        """Appends one row for each row in ``parents``, with the values of that row."""
        names = ["weight", "bulk", "sums", "strain", "more"]
        names += ["gradient", "projected", "pressure", "volumes"] if self.split else []
        names += ["matter"] if self.pressed else []
        for name in names:
            values = getattr(self, name)
            setattr(self, name, extended(values, values[parents]))

    @property
    def stored(self) -> dict[str, "np.ndarray"]:
        """Returns a dictionary of the columns for a checkpoint; the keys are the names of the columns."""
        names = ["_weight", *(["pressure", "_projected"] if self.split else []), *(["_matter"] if self.pressed else [])]
        return {name: getattr(self, _STORED[name]) for name in names}

    def restore(self, columns: dict[str, "np.ndarray"]) -> None:
        """Sets the columns of the means to those of a checkpoint."""
        for name, column in columns.items():
            setattr(self, _STORED[name], column)
