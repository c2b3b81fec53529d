"""Removal of eroded tets from bodies that break. The module updates the tables of fracture and finds the stars that the
removal cuts.

The facets of a removed tet are removed, too. Erosion (worker/erosion.py) removes tets at the start of a step:

    1. Open the narrow cracks at the tets: the side that remains is surface from now on.     begin
    2. Close their cohesive facets, whose last traction acts in one more step.               begin
    3. Move the rows of all tables by tet as the block does.                                 drop
    4. Expose the faces behind the tets.                                                     Contact.uncover, or end
    5. Make the tables of facets between blocks and between ranks again.                     end
    6. At the end of the step, separate the nodes whose stars the removal has cut.           Separation.survey

A node keeps the mass and the last forces of its removed tets; a copy takes the mass of its own tets.
"""

import numpy as np

from ..contact.stage import Contact
from ..contact.surface import exposure
from ..elements.forms import Elements
from ..model.moves import Moves
from ..model.state import Flags, Ints, Model
from ..parallel.comm import Comm
from . import facets
from .cohesive import Cohesion
from .initiation import Initiation
from .separation import Separation, distinct


class Removal:
    """Removal of tets from the bodies of one rank that break. Methods are called on all ranks, in the order above."""

    def __init__(
        self, model: Model, initiation: Initiation, separation: Separation, cohesion: Cohesion | None,
        elements: Elements, contact: Contact | None, comm: Comm,
    ) -> None:  # fmt: skip
        self._model, self._initiation, self._separation = model, initiation, separation
        self._cohesion, self._elements, self._contact, self._comm = cohesion, elements, contact, comm
        self._nodes = np.zeros(0, np.int64)
        """Local nodes, ascending, of the tets that are removed in this step."""

    def begin(self, worn: list[Ints]) -> None:
        """Prepares the removal of the tets ``worn`` (k,) of each block; ``worn`` are the tets that meet the erosion
        criterion. Collective.
        """
        none, blocks = np.zeros(0, np.int64), self._model.blocks
        some = [(block, gone) for block, gone in zip(blocks, worn, strict=True) if len(block.bond)]
        corners = [block.tets[gone].reshape(-1).astype(np.int64) for block, gone in some]
        self._nodes = distinct(np.concatenate([none, *corners]))
        gone = np.sort(self._comm.join(np.concatenate([none, *(block.id[gone] for block, gone in some)])))
        if self._contact is not None:
            self._contact.found.opening = self._contact.exterior.cracks.at_tets(gone)
            self._contact.open_cracks()
        if self._cohesion is not None:
            self._cohesion.close(gone)

    def drop(self, index: int, moves: Moves) -> None:
        """Updates the tables after the removal of tets from the block number ``index``."""
        if index not in self._separation.stars:
            return
        places, block = moves.places, self._model.blocks[index]
        mesh = self._separation.meshes[index] = facets.without(self._separation.meshes[index], block, moves)
        self._separation.stars[index].drop(places)
        self._initiation.drop(index, mesh, moves)
        if self._contact is not None:
            self._contact.exterior.cracks.drop(index, places)

    def end(self, gone: Ints, held: Flags) -> None:
        """Completes the tables, and chooses the nodes of the removed tets for the separation at the end of the step;
        ``gone`` (k, exposure.WORDS): the removed tets; ``held`` (nodes,): True for nodes that have tets. Collective.
        """
        if self._contact is None:
            rows = self._comm.join(gone.reshape(-1)).reshape(-1, exposure.WORDS)
            exposure.expose(self._model.blocks, exposure.exposed_by(rows).bare)
        self._initiation.reconnect()
        if self._comm.size > 1:
            self._elements.attach(self._initiation.interface)
        self._separation.cut = self._nodes[held[self._nodes]]
