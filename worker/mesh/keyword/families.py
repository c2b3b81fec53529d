"""Keywords of LS-DYNA, by their effect on a mesh (Keyword User's Manual, volumes I to III)."""

from collections.abc import Container

from conoid.cases.reading.cards import Block

from ...errors import MeshError


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


SOLIDS = {"": 8, "ORTHO": 8, "DOF": 8, "H20": 20, "H27": 27}
"""Options of ``*ELEMENT_SOLID`` that are read, with the number of nodes of an element."""
FURTHER = {"ORTHO": 2, "DOF": 1}
"""Number of cards of an element after the cards with its nodes, for each option."""
REFUSED = (
    "NODE_TRANSFORM", "NODE_MERGE", "NODE_REFLECT", "PART_DUPLICATE", "PART_MOVE", "PART_STACKED", "ELEMENT_GENERATE",
    "ELEMENT_SOLID", "ELEMENT_BLANKING", "STRUCTURED_MESH", "ALE_STRUCTURED_MESH", "MESH", "IGA",
)  # fmt: skip
"""Beginnings of the keywords that make, move or join nodes and elements. The reader does not support keywords that
change nodes or elements."""
VOLUMES = ("ELEMENT_TSHELL", "ELEMENT_SPH", "ELEMENT_LANCING")
"""Keywords of volume elements or particles that are not read."""
JOINING = ("CONSTRAINED", "CONTACT", "RIGIDWALL", "RIGID", "ELEMENT_MASS", "ELEMENT_INERTIA")
"""Beginnings of the keywords that join or hold bodies, or give them mass. Keywords that join or hold bodies have no
effect on the mesh."""
FAMILIES = _words(
    """
    AIRBAG ALE BATTERY BOUNDARY CASE CHEMISTRY CESE COMMENT COMPONENT CONSTRAINED CONTACT CONTROL CPM DAMPING DATABASE
    DEFINE DEFORMABLE DEM DUALCESE EF ELEMENT EM END EOS FATIGUE FREQUENCY HOURGLASS ICFD INITIAL INTEGRATION INTERFACE
    KEYWORD LOAD LSO MAT MODULE NODE PARAMETER PART PARTICLE PERTURBATION RAIL RIGID RIGIDWALL RVE SECTION SENSOR SET
    STOCHASTIC TERMINATION TITLE UNIT USER
    """
)
"""First words of known keywords. A keyword that is not listed is an error, because it could make or move nodes."""


def refuse(block: Block, read: Container[str]) -> None:
    """Raise MeshError for a keyword that is not ``read`` and could change the mesh."""
    if block.name in read:
        return
    if block.name.startswith(REFUSED):
        raise MeshError(f"{block.place()}: *{block.name} is not supported; write the nodes and elements out")
    if block.name.partition("_")[0] not in FAMILIES:
        raise MeshError(f"{block.place()}: the keyword *{block.name} is not known; it could change the mesh")
