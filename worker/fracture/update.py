"""Update of all tables after facets broke: arrays by node, forces, cohesive facets, and contact."""

from ..contact.stage import Contact
from ..elements.forms import Elements
from ..model.state import Model
from ..model.topology import KeptByNode, Split
from .breaking import Breaking
from .cohesive import Cohesion
from .columns import Facets
from .handover import Handover
from .initiation import Initiation


class TopologyUpdate:
    """All tables of one rank that depend on the topology."""

    def __init__(
        self, model: Model, elements: Elements, initiation: Initiation, by_node: list[KeptByNode], handover: Handover,
        contact: Contact | None,
    ) -> None:  # fmt: skip
        """``by_node``: all objects that have arrays by node, except the elements."""
        self._model, self._elements, self._initiation, self._by_node = model, elements, initiation, by_node
        self._handover, self._contact = handover, contact

    def apply(
        self, broken: list[Breaking], split: Split, fresh: list[Facets], cohesion: Cohesion | None
    ) -> None:  # fmt: skip
        """Updates all tables for the ``broken`` facets, the new cohesive facets ``fresh`` among them, and the separated
        nodes. Collective among the ranks that share copies or have ghosts of their surface.
        """
        if split.copies.n:
            self._grow(split)
            self._handover.hand_over(split, cohesion, fresh)
        for new in fresh:
            assert cohesion is not None
            cohesion.insert(new)
        if self._contact is not None:
            for b in broken:
                self._contact.crack(b.facets.faces, b.facets.nodes, b.facets.sides)
            self._contact.separate(split)

    def _grow(self, split: Split) -> None:
        self._initiation.follow(split)
        self._elements.grow(split)
        for each in self._by_node:
            each.grow(split, self._model.nodes.id)
