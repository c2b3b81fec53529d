"""Sets of nodes of mesh files, in the frames of a run."""

from typing import Any

import numpy as np

from conoid.cases.output import layout
from conoid.cases.reading.similar import allowed

from ..errors import LookError

_SET = layout.set_array("")


def of_set(mesh: Any, name: str) -> Any:
    """Returns the tets of a frame that have a node in the set ``name``, or the whole mesh if ``name`` is empty.
    Raises LookError if the frame does not have the set, or if no tet has a node in it.
    """
    if not name:
        return mesh
    known = {array.removeprefix(_SET): array for array in mesh.point_data if array.startswith(_SET)}
    array = layout.set_array(name)
    if array not in known.values():
        hint = allowed(name, known) if known else "the frame has no sets; a case names its sets in run.sets"
        raise LookError(f"on = {name!r}: {hint}")
    chosen = mesh.extract_points(np.flatnonzero(mesh.point_data[array]), adjacent_cells=True, include_cells=True)
    if not chosen.n_cells:
        raise LookError(f"on = {name!r}: no tet of the frame has a node in the set")
    return chosen
