"""The tags of all messages between two ranks. Two exchanges that may be under way at once never share one, but for
trades: messages between two ranks arrive in the order in which they were sent, and both trade in the same order.
"""

from enum import IntEnum, unique


@unique
class Tag(IntEnum):
    """What a message carries."""

    SCATTER = 0
    """An item from rank 0 for one rank (parallel/mpi.py)."""
    FORCE = 1
    """Sums of nodal forces, in every step (elements/forms.py)."""
    VOLUME = 2
    """Sums of nodal volumes, in every step of the averaged pressure forms (elements/averaging.py)."""
    GRADIENT = 3
    """Sums of nodal pressure gradients, in every step of the ``split`` form (elements/averaging.py)."""
    SURFACE = 10
    """Which nodes are on the surface, when it is built (contact/surface.py)."""
    GHOST = 11
    """Positions and velocities of the nodes of ghost faces, in every step with contact (contact/ghosts.py)."""
    CONTACT_FLAGS = 12
    """Which shared nodes are pushed, in every step with contact (contact/company.py)."""
    CONTACT = 13
    """Sums of the row weights and of the impulses of a sweep at nodes that are pushed (contact/company.py)."""
    NORMAL = 14
    """Sums of the face normals at nodes, in every sixteenth step and after erosion (contact/normals.py)."""
    TETS_AT_NODE = 15
    """How many tets a node has, at the start and in every removal (erosion.py)."""
    TRACTION = 17
    """Stress on the other side of facets between two ranks, in every step that asks for tractions
    (fracture/interface.py)."""
    NODAL_STRESS = 18
    """Sums of stress and mass at nodes, for the ``nodal`` criterion (fracture/nodal.py)."""
    COURSE = 19
    """Sums of the rigid motions of the tets at nodes, in every search of a body that fractures (contact/course.py)."""
    RELEASE = 20
    """Changes of the forces of cohesive facets that let go, in every step once facets have broken
    (fracture/release.py)."""
    LOAD = 21
    """Sums of the forces of a pressure that follows the surface, in every step (surface_pressure.py)."""
    BOND = 22
    """Sums of the impulses of a sweep at tied nodes, in every step with bonds of meshes that do not match
    (bonds/layout.py)."""
    BONDED = 23
    """Positions and velocities of tied nodes that are not held, likewise (bonds/layout.py)."""
    SWAP = 90
    """Words of which the receiver learns the number first (parallel/mpi.py)."""
    TRADE = 91
    """Words for some ranks, from those who know of it (parallel/mpi.py)."""
