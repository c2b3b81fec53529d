"""The active contacts of a step: pairs that are due are registered, then the narrow phase tests what may meet."""

from dataclasses import dataclass

import numpy as np

from ..state import Floats, Ints
from . import registration
from .cracks import across
from .edge_edge import edge_edge
from .narrow_phase import Step
from .node_face import approach, node_face
from .scene import Scene

_KINEMATIC = 2.0
"""One over the share of a tet's altitude that anything may pass in a step."""


@dataclass
class Detected:
    """What a step has found; the active contacts themselves are the first rows of the scene's room."""

    contacts: int
    """How many."""
    approach: float
    """One over the step in which no node passes more than half of a tet that it meets, 1/s."""
    opening: Ints
    """Rows of the cracks that have become so wide that they open."""

    @classmethod
    def nothing(cls) -> "Detected":
        """Before the first step."""
        return cls(0, 0.0, np.zeros(0, np.int64))


def detect(now: Scene, mu: Floats, give: float, dt: float, size: float, redraw: bool) -> Detected:
    """The active contacts of the step ahead, ``dt``, s, of the positions and velocities of the scene's nodes.

    ``mu`` (parts, parts): friction, NaN where two parts do not meet; ``give``: see narrow_phase.PUSH_OUT; ``size``: the
    typical one of a face, m; ``redraw``: whether short lines are drawn anew (tracks.py).
    """
    crowd, tracks = now.crowd, now.tracks
    tracks.advance(dt)
    if redraw:
        tracks.shorten(crowd.x)
        now.node_face.wake()
        now.edge_edge.wake()
    tracks.measure(crowd.x, crowd.v, now.faces.corners, now.edges.corners)
    strayed = float(tracks.searched.left[now.slots.tracked].max(initial=0.0))
    if strayed > 0.5 * now.rules.skin or now.pending:
        registration.renew(now, crowd.x, crowd.v, strayed)
    now.reserve()
    return _test(now, Step.of(crowd.x, crowd.v, crowd.part, mu, give, dt), size)


def _test(now: Scene, step: Step, size: float) -> Detected:
    """The narrow phase."""
    tracks, faces, pairs = now.tracks, now.face_table(), now.node_face.arrays()
    n, tested = node_face(now.active.room, 0, pairs, now.slot_table(), faces, step, tracks.end)
    now.node_face.tested = pairs.active[:tested]
    limit = _KINEMATIC * approach(now.active.room, n, pairs, faces, step)
    pairs = now.edge_edge.arrays()
    n, tested = edge_edge(now.active.room, n, pairs, now.edge_table(), step, tracks.short.course, tracks.end)
    now.edge_edge.tested = pairs.active[:tested]
    now.faces.fresh[:], now.edges.fresh[:], now.slots.fresh[:] = False, False, False
    opening = np.empty(len(now.cracks), np.int64)
    n, wide = across(now.active.room, n, opening, now.cracks, size, step)
    return Detected(int(n), limit, opening[:wide])
