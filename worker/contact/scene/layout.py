"""Construction of a scene: its slots, faces and edges, without pairs."""

import numpy as np

from ...model.state import Floats, Nodes
from ...parallel.comm import Comm
from ...parallel.team import team
from ..broad_phase.reference_motion import ReferenceMotion
from .columns import OwnSlots, SceneEdges, SceneFaces, SceneSlots
from .near_surface import NearSurface, Rules, with_ghosts
from .passes import ScenePasses
from .scene import Scene


def build(
    sides: NearSurface, rules: Rules, horizon: float, drift: Floats, nodes: Nodes, comm: Comm,
    passes: ScenePasses | None = None,
) -> Scene:  # fmt: skip
    """Returns the scene of the surface ``sides``, without pairs. ``horizon``: simulated time for which the scene is
    used, s. ``drift`` (3,): mean velocity, m/s, equal on all ranks; ``passes``: passes of the scene, None for one
    thread. Collective.

    The lists of shared nodes are added later, by a SplitUpdate.
    """
    seen = with_ghosts(sides, rules, horizon, drift, comm) if comm.size > 1 else sides
    passes = passes or ScenePasses(team(1))
    order = np.argsort(passes.curve(seen.surface_nodes.x, rules.cell))
    surface_nodes, faces, edges = seen.surface_nodes.spacious(order), seen.faces, seen.edges
    corners, ends = (passes.located(surface_nodes.id, some.nodes) for some in (faces, edges))
    surface_nodes.local = nodes.places(surface_nodes.id)
    owned, pushes = np.zeros(surface_nodes.n, bool), np.zeros(surface_nodes.n, bool)
    owned[passes.located(surface_nodes.id, sides.owned)] = True
    passes.flag_corners(pushes, corners, 3)
    passes.flag_corners(pushes, ends, 2)
    rank = np.arange(edges.n)
    if edges.n > sides.edges.n:
        rank[np.lexsort((edges.sides[:, 1], edges.sides[:, 0]))] = np.arange(edges.n)
    own, beside = np.arange(edges.n) < sides.edges.n, passes.located(faces.id, edges.sides)
    return Scene(
        surface_nodes=surface_nodes, own=OwnSlots.of(surface_nodes, nodes.n),
        slots=SceneSlots.at_rest(owned, pushes | owned),
        faces=SceneFaces.at_rest(corners, faces.id, faces.size, faces.exposed.copy()),
        edges=SceneEdges.at_rest(
            ends, edges.sides, beside, np.stack([edges.size, edges.deep]), edges.opened.copy(),
            edges.sharp.copy(), own, rank,
        ),
        rules=rules, reference=ReferenceMotion(surface_nodes.x, surface_nodes.course, faces.n, edges.n, drift, horizon),
        cracks=np.zeros((0, 6), np.int32), passes=passes,
    )  # fmt: skip
