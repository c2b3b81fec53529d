"""Rigid bodies of a Radioss starter: ``/RBODY`` of all nodes of a part."""

from collections.abc import Callable, Sequence

from ..account import Entry
from ..draft import Body
from ..topology import Chosen, Topology
from .text import Fields, Option
from .words import REFUSED

_LAYOUT = (
    "NODE: SENS: SKEW: ISPHER: MASS GRNOD: IKREM: ICOG: SURF:", "JXX JYY JZZ", "JXY JYZ JXZ", "IOPTOFF: - IEXPAMS:",
)  # fmt: skip
"""Lines below the title (Reference Guide, /RBODY)."""


def rigid(
    option: Option, entry: Entry, bodies: Sequence[Body], topology: Topology, nodes: Callable[[int, Entry], Chosen]
) -> tuple[int, str] | None:
    """Makes the body of an option's nodes rigid; returns its main node, and the key of the body. Returns None if the
    option is refused. Raises CardError, ValueError.
    """
    fields = Fields(option, entry, option.rows[1:], _LAYOUT)
    fields.refuse("SENS", "a body that becomes rigid later")
    fields.refuse("MASS JXX JYY JZZ JXY JYZ JXZ", "mass and inertia beside those of the mesh; give parts[].rigid")
    fields.refuse("SURF", "an envelope of another shape")
    fields.forgive("SKEW ISPHER IKREM ICOG IOPTOFF IEXPAMS", "axes and place of the main node, and how rows are solved")
    main, (full, some) = fields.whole("NODE"), topology.whole(nodes(fields.whole("GRNOD"), entry))
    fields.rest()
    if some or len(full) != 1:
        entry.refuse(REFUSED["RBODY"])
        return None
    next(body for body in bodies if body.key == full[0]).rigid = True
    entry.take("parts[].rigid")
    return main, full[0]
