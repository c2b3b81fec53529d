"""Check that the file of a frame is complete. For a damaged file VTK would read beyond the ends of arrays, or print
messages of its own.
"""

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from ..errors import ViewError

_LISTS = ("Points", "Connectivity", "Offsets", "Types")


def require_whole(path: str) -> None:
    """Raises ViewError if the file is damaged or is not a frame; the message contains ``path``. Raises OSError if
    the file cannot be opened.
    """
    with Path(path).open("rb"):  # h5py has unclear messages for a missing or unreadable file.
        pass
    try:
        with h5py.File(path, "r") as file:
            wrong = _wrong(file)
    except (OSError, RuntimeError, KeyError, ValueError, TypeError, AttributeError) as error:
        wrong = " ".join(str(error).split())[:200]
    if wrong:
        raise ViewError(f"{path}: this file is not a frame, or is damaged: {wrong}")


def _wrong(file: Any) -> str:
    """Returns a text that describes the damage of a VTKHDF file; empty for a complete file. Raises the errors of
    h5py if h5py cannot read the file.
    """
    root = file.get("VTKHDF")
    if not isinstance(root, h5py.Group):
        return "the file has no group VTKHDF"
    if missing := [name for name in _LISTS if name not in root]:
        return f"it has no {missing[0]}"
    points, cells, ids = (np.asarray(root[f"NumberOf{name}"]) for name in ("Points", "Cells", "ConnectivityIds"))
    sizes = {"Points": points.sum(), "Connectivity": ids.sum(), "Offsets": (cells + 1).sum(), "Types": cells.sum()}
    lists = {name: np.asarray(root[name]) for name in _LISTS}
    for name, size in sizes.items():
        if len(lists[name]) != size:
            return f"{name} has {len(lists[name])} entries instead of {size}"
    for group, size in (("PointData", points.sum()), ("CellData", cells.sum())):
        for name, values in root.get(group, {}).items():
            if len(np.asarray(values)) != size:
                return f"{group}/{name} has {len(values)} entries instead of {size}"
    return _astray(lists, points, cells, ids)


def _astray(lists: dict[str, Any], points: Any, cells: Any, ids: Any) -> str:
    """Returns a text about non-finite coordinates or about pieces whose cells refer to missing nodes; empty for a
    correct frame.
    """
    if not np.isfinite(lists["Points"]).all():
        return "a coordinate is not finite"
    first = first_cell = 0
    for n, (of_points, of_cells, of_ids) in enumerate(zip(points, cells, ids, strict=True)):
        corners = lists["Connectivity"][first : first + of_ids]
        offsets = lists["Offsets"][first_cell : first_cell + of_cells + 1]
        within = not len(corners) or (corners.min() >= 0 and corners.max() < of_points)
        if not within or offsets[0] != 0 or offsets[-1] != of_ids or (np.diff(offsets) < 0).any():
            return f"cells of piece {n} refer to nodes that the piece does not have"
        first, first_cell = first + of_ids, first_cell + of_cells + 1
    return ""
