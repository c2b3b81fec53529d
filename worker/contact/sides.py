"""The surface near a rank: its own, and what other ranks have near it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..model.state import Flags, Floats, Indices, Ints
from ..parallel.comm import Comm
from . import domain, ghosts, search
from .narrow_phase import DEEP
from .records import Crowd, Edges, Faces, merged
from .search import Boxes, Things

HALO = 1.0
"""Of the typical size of a face: two slots of different ranks that leave their lines by half of this, each, may meet
unseen; a search of all ranks comes before."""


@dataclass(frozen=True)
class Rules:
    """How to search; equal on all ranks."""

    domain: str
    allowed: Flags
    """(parts, parts) which parts meet."""
    cell: float
    """Edge of a cell of the contact domain, m."""
    skin: float
    """Two slots that leave their lines by half of this, each, may meet without being candidates, m."""
    halo: float
    """The same of slots of different ranks, m."""
    itself: Flags
    """(parts,) whether the body of each may meet itself."""


@dataclass
class Sides:
    """A share of the surface, with its nodes."""

    faces: Faces
    """By ascending id."""
    edges: Edges
    crowd: Crowd
    """Every node of the faces and edges, and every node of the surface that is held here."""
    slaves: Ints
    """Ids of the owned nodes of the surface, and of cracks that may open."""

    @cached_property
    def face_places(self) -> Indices:
        """(f, 4)."""
        return self.crowd.places(self.faces.nodes)

    @cached_property
    def edge_places(self) -> Indices:
        """(e, 4)."""
        return self.crowd.places(self.edges.nodes)

    def boxes(self, horizon: float, drift: Floats, margin: float) -> list[Boxes]:
        """Of the slaves, the faces and the edges, with ``margin``, m, on all sides."""
        x, course = self.crowd.x, self.crowd.course - drift
        slaves = Things(self.crowd.places(self.slaves[:, None]), np.full(len(self.slaves), margin))
        faces = Things(np.ascontiguousarray(self.face_places[:, :3]), margin + DEEP * self.faces.size)
        edges = Things(np.ascontiguousarray(self.edge_places[:, :2]), margin + 0.5 * self.edges.deep)
        return [search.swept(things, x, course, horizon) for things in (slaves, faces, edges)]


def with_ghosts(sides: Sides, rules: Rules, horizon: float, drift: Floats, comm: Comm) -> Sides:
    """The sides with what other ranks' surfaces have near this one's, own edges first."""
    nodes, faces, edges = sides.boxes(horizon, drift, 0.5 * rules.halo)
    askers = Boxes(np.concatenate([nodes.low, edges.low]), np.concatenate([nodes.high, edges.high]))
    chosen = domain.choose(rules.domain, askers, [faces, edges], rules.cell, comm)
    got = comm.swap({rank: ghosts.pack(*_some_of(sides, *flags)) for rank, flags in chosen.items()})
    others = [ghosts.unpack(words) for words in got.values()]
    return _joined(sides, others)


def _some_of(sides: Sides, faces: Flags, edges: Flags) -> tuple[Faces, Edges, Crowd]:
    """Some of the faces and of the edges, and the nodes of these."""
    nodes = np.zeros(sides.crowd.n, bool)
    nodes[sides.face_places[faces]] = nodes[sides.edge_places[edges]] = True
    return sides.faces.take(faces), sides.edges.take(edges), sides.crowd.take(nodes)


def _joined(sides: Sides, others: list[tuple[Faces, Edges, Crowd]]) -> Sides:
    faces = Faces.joined([sides.faces, *(faces for faces, _, _ in others)])
    edges = Edges.joined([sides.edges, *(edges for _, edges, _ in others)])
    crowd = merged([sides.crowd, *(crowd for _, _, crowd in others)])
    return Sides(faces.take(np.argsort(faces.id)), edges, crowd, sides.slaves)
