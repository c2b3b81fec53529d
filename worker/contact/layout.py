"""The surface laid out as a scene: slots, faces and edges, without pairs."""

import numpy as np

from ..model.ids import places
from ..model.state import Floats, Nodes
from ..parallel.comm import Comm
from . import buckets
from .columns import OwnSlots, SceneEdges, SceneFaces, SceneSlots
from .scene import Scene
from .sides import Rules, Sides, with_ghosts
from .tracks import Tracks


def build(sides: Sides, rules: Rules, horizon: float, drift: Floats, nodes: Nodes, comm: Comm) -> Scene:
    """The scene of ``sides``, which flies on for ``horizon``, s, without pairs; all ranks take part and know of the
    same ``drift`` (3,), m/s.

    Who shares which node is settled by a Follower.
    """
    seen = with_ghosts(sides, rules, horizon, drift, comm) if comm.size > 1 else sides
    order = np.argsort(buckets.curve(seen.crowd.x, rules.cell))
    crowd, faces, edges = seen.crowd.take(order), seen.faces, seen.edges
    slot = np.empty(crowd.n, np.int32)
    slot[order] = np.arange(crowd.n)
    corners, ends = slot[seen.face_places], slot[seen.edge_places]
    crowd.local = nodes.places(crowd.id)
    slave, pushes = np.zeros(crowd.n, bool), np.zeros(crowd.n, bool)
    slave[slot[seen.crowd.places(sides.slaves)]] = True
    pushes[corners[:, :3]] = pushes[ends[:, :2]] = True
    rank = np.arange(edges.n)
    if edges.n > sides.edges.n:
        rank[np.lexsort((edges.sides[:, 1], edges.sides[:, 0]))] = np.arange(edges.n)
    own = np.arange(edges.n) < sides.edges.n
    return Scene(
        crowd=crowd, own=OwnSlots.of(crowd, nodes.n), slots=SceneSlots.at_rest(slave, pushes | slave),
        faces=SceneFaces.at_rest(corners, faces.id, faces.size, faces.exposed.copy()),
        edges=SceneEdges.at_rest(
            ends, edges.sides, places(faces.id, edges.sides), np.stack([edges.size, edges.deep]), edges.opened.copy(),
            edges.sharp.copy(), own, rank,
        ),
        rules=rules, tracks=Tracks(crowd.x, crowd.course, faces.n, edges.n, drift, horizon),
        cracks=np.zeros((0, 6), np.int32),
    )  # fmt: skip
