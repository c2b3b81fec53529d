"""Surface near one rank: the surface of the rank, and ghosts of the surfaces of other ranks."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...model.state import Flags, Floats, Indices, Ints
from ...parallel.comm import Comm
from ..broad_phase import boxes, domain
from ..broad_phase.boxes import Boxes, Primitives
from ..narrow_phase.tables import DEEP
from ..surface.records import Edges, Faces, SurfaceNodes, merged
from . import ghosts

HALO = 1.0
"""Ratio of the width of the halo to the typical size of a face. Candidate pairs between slots of different ranks are
complete only while each slot has departed from its reference motion by less than half of this width. Before a slot
departs further from its reference motion, all ranks search again."""


@dataclass(frozen=True)
class Rules:
    """Parameters of the searches. All ranks have equal values."""

    domain: str
    allowed: Flags
    """(parts, parts) True for each pair of parts that may be in contact."""
    cell: float
    """Length of the edge of a cell of the contact domain, m."""
    skin: float
    """Skin, m. If two slots have both departed from their reference motions by less than half of the skin, they can be
    in contact only if they are a candidate pair."""
    halo: float
    """Skin for pairs of slots of different ranks, m."""
    self_contact: Flags
    """(parts,) True for each part whose body may be in contact with itself."""


@dataclass
class NearSurface:
    """A part of the surface, with its nodes."""

    faces: Faces
    """Faces by ascending id."""
    edges: Edges
    surface_nodes: SurfaceNodes
    """Nodes of all faces and edges, and all local surface nodes."""
    owned: Ints
    """Global ids of the nodes that this rank owns and that are on the surface or on cracks that may open."""

    @cached_property
    def face_places(self) -> Indices:
        """(f, 4) rows of the nodes of the faces."""
        return self.surface_nodes.places(self.faces.nodes)

    @cached_property
    def edge_places(self) -> Indices:
        """(e, 6) rows of the nodes of the edges."""
        return self.surface_nodes.places(self.edges.nodes)

    def boxes(self, horizon: float, drift: Floats, margin: float) -> list[Boxes]:
        """Bounding boxes of owned nodes, faces and edges. Each box contains the motion in the next ``horizon``, s, and
        is enlarged by ``margin``, m, on all sides."""
        x, course = self.surface_nodes.x, self.surface_nodes.course - drift
        owned = Primitives(self.surface_nodes.places(self.owned[:, None]), np.full(len(self.owned), margin))
        faces = Primitives(np.ascontiguousarray(self.face_places[:, :3]), margin + DEEP * self.faces.size)
        edges = Primitives(np.ascontiguousarray(self.edge_places[:, :2]), margin + 0.5 * self.edges.deep)
        return [boxes.swept(things, x, course, horizon) for things in (owned, faces, edges)]


def with_ghosts(sides: NearSurface, rules: Rules, horizon: float, drift: Floats, comm: Comm) -> NearSurface:
    """Returns ``sides`` together with the ghosts near this rank's surface. In the result the edges of this rank come
    first.
    """
    nodes, faces, edges = sides.boxes(horizon, drift, 0.5 * rules.halo)
    askers = Boxes(np.concatenate([nodes.low, edges.low]), np.concatenate([nodes.high, edges.high]))
    chosen = domain.choose(rules.domain, askers, [faces, edges], rules.cell, comm)
    got = comm.swap({rank: ghosts.pack(*_some_of(sides, *flags)) for rank, flags in chosen.items()})
    others = [ghosts.unpack(words) for words in got.values()]
    return _joined(sides, others)


def _some_of(sides: NearSurface, faces: Flags, edges: Flags) -> tuple[Faces, Edges, SurfaceNodes]:
    """Selects faces and edges, and the nodes of these faces and edges."""
    nodes = np.zeros(sides.surface_nodes.n, bool)
    nodes[sides.face_places[faces]] = nodes[sides.edge_places[edges]] = True
    return sides.faces.take(faces), sides.edges.take(edges), sides.surface_nodes.take(nodes)


def _joined(sides: NearSurface, others: list[tuple[Faces, Edges, SurfaceNodes]]) -> NearSurface:
    faces = Faces.joined([sides.faces, *(faces for faces, _, _ in others)])
    edges = Edges.joined([sides.edges, *(edges for _, edges, _ in others)])
    surface_nodes = merged([sides.surface_nodes, *(surface_nodes for _, _, surface_nodes in others)])
    return NearSurface(faces.take(np.argsort(faces.id)), edges, surface_nodes, sides.owned)
