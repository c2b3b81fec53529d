"""Applies what breaks in a step to the tables that it changes: by node, forces, cohesive facets, contact."""

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
    """The tables of one rank that follow nodes as they separate."""

    def __init__(
        self, model: Model, elements: Elements, initiation: Initiation, by_node: list[KeptByNode], handover: Handover,
        contact: Contact | None,
    ) -> None:  # fmt: skip
        """``by_node``: besides the elements, what has arrays by node."""
        self._model, self._elements, self._initiation, self._by_node = model, elements, initiation, by_node
        self._handover, self._contact = handover, contact

    def apply(
        self, broken: list[Breaking], split: Split, fresh: list[Facets], cohesion: Cohesion | None
    ) -> None:  # fmt: skip
        """Takes up the ``broken`` facets, ``fresh`` cohesive ones among them, and the nodes that have separated. Ranks
        that share copies, or have copies of their surface, take part.
        """
        if split.copies.n:
            self._grow(split)
            self._handover.hand_over(split, cohesion, fresh)
        for new in fresh:
            assert cohesion is not None
            cohesion.insert(new)
        if self._contact is not None:
            for b in broken:
                self._contact.crack(b.facets.tets, b.facets.nodes, b.facets.sides)
            self._contact.separate(split)

    def _grow(self, split: Split) -> None:
        self._initiation.follow(split)
        self._elements.grow(split)
        for each in self._by_node:
            each.grow(split, self._model.nodes.id)
