"""Rigid bodies of a Radioss starter. An ``/RBODY`` must have all nodes of a part."""

from collections.abc import Callable, Sequence

from ..account import Entry
from ..draft import Body
from ..topology import Chosen, Topology
from .text import Fields, Option
from .words import REFUSED

_LAYOUT = (
    "NODE: SENS: SKEW: ISPHER: MASS GRNOD: IKREM: ICOG: SURF:", "JXX JYY JZZ", "JXY JYZ JXZ", "IOPTOFF: - IEXPAMS:",
)  # fmt: skip
"""Names of the fields on the lines below the title (Reference Guide, /RBODY)."""


def rigid(
    option: Option, entry: Entry, bodies: Sequence[Body], topology: Topology, nodes: Callable[[int, Entry], Chosen]
) -> tuple[int, str] | None:
    """Makes the body with an option's nodes rigid; returns its main node, and the key of the body. Returns None if
    the option is refused. Raises CardError, ValueError.
    """
    fields = Fields(option, entry, option.rows[1:], _LAYOUT)
    fields.refuse("SENS", "the body becomes rigid only after the start")
    fields.refuse(
        "MASS JXX JYY JZZ JXY JYZ JXZ", "mass and inertia in addition to those of the mesh; give parts[].rigid"
    )
    fields.refuse("SURF", "surface that replaces the shape of the body")
    fields.forgive(
        "SKEW ISPHER IKREM ICOG IOPTOFF IEXPAMS", "axes and position of the main node, and settings of the solver"
    )
    main, (full, some) = fields.whole("NODE"), topology.whole(nodes(fields.whole("GRNOD"), entry))
    fields.rest()
    if some or len(full) != 1:
        entry.refuse(REFUSED["RBODY"])
        return None
    next(body for body in bodies if body.key == full[0]).rigid = True
    entry.take("parts[].rigid")
    return main, full[0]
