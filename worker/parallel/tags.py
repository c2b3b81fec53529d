"""Tags of the messages between two ranks.

Two exchanges that may be in progress at the same time never have the same tag. All calls of ``trade`` use one tag:
messages between two ranks arrive in the order in which they were sent, and the two ranks make the calls in the same
order.
"""

from enum import IntEnum, unique


@unique
class Tag(IntEnum):
    """Content of a message, by which messages are distinguished."""

    SCATTER = 0
    """An item from rank 0 for one rank (parallel/mpi.py)."""
    FORCE = 1
    """Sums of nodal forces, in every step (elements/forms.py)."""
    VOLUME = 2
    """Sums of nodal volumes, in every step of the averaged pressure forms (elements/averaging.py)."""
    GRADIENT = 3
    """Sums of nodal pressure gradients, in every step of the ``split`` form (elements/averaging.py)."""
    SURFACE = 10
    """Flags of surface nodes, when the surface is built (contact/surface/surface.py)."""
    GHOST = 11
    """Positions and velocities of the nodes of ghost faces, in every step with contact (contact/scene/ghosts.py)."""
    CONTACT_FLAGS = 12
    """Flags of shared nodes in contact, in every step with contact (contact/solver/shared_sums.py)."""
    CONTACT = 13
    """Sums of the row weights and of the impulses of a sweep at nodes in contact (contact/solver/shared_sums.py)."""
    NORMAL = 14
    """Sums of the face normals at nodes, in every sixteenth step and after erosion (contact/surface/normals.py)."""
    TETS_AT_NODE = 15
    """Number of tets at a node, at the start and in every removal (erosion.py)."""
    TRACTION = 17
    """Stress on the other side of facets between two ranks, in every step in which a facet is overstressed
    (fracture/interface.py)."""
    NODAL_STRESS = 18
    """Sums of stress and mass at nodes, for the ``nodal`` criterion (fracture/nodal.py)."""
    COURSE = 19
    """Sums of the rigid motions of the tets at nodes, in every search of a body that fractures
    (contact/broad_phase/extrapolation.py).
    """
    RELEASE = 20
    """Changes of the forces of unloaded cohesive facets, in every step once facets have broken
    (fracture/unloading.py)."""
    LOAD = 21
    """Sums of the forces of a pressure that follows the surface, in every step (boundaries/surface_pressure.py)."""
    BOND = 22
    """Sums of the impulses of a sweep at tied nodes, in every step with bonds of meshes that do not match
    (bonds/layout.py)."""
    BONDED = 23
    """Positions and velocities of tied nodes that this rank does not have, in every step with bonds of meshes that do
    not match (bonds/layout.py)."""
    SWAP = 90
    """Words whose number the receiver does not know in advance; the number is exchanged first (parallel/mpi.py)."""
    TRADE = 91
    """Words between two partners that have both planned the message (parallel/mpi.py)."""
