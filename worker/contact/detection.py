"""The active contacts of a step: pairs that are due are registered, then the narrow phase tests what may meet."""

from dataclasses import dataclass

import numpy as np

from ..state import Floats, Indices, Ints
from . import registration
from .cracks import across
from .edge_edge import edge_edge
from .entering import pushed_out
from .exterior import Exterior
from .haste import approach, spread
from .narrow_phase import HASTY, Step
from .node_face import node_face
from .scene import Scene

_KINEMATIC = 2.0
"""One over the share of a tet's altitude that anything may pass in a step."""
_JOIN = 0.6
"""Of the distance at which a slot has to be registered anew: a rank whose slots have strayed so far does it when
another one has to, so that ranks do not wait for one after the other. No bit of the answer depends on it."""


@dataclass
class Detected:
    """What a step has found; the active contacts themselves are the first rows of the scene's room."""

    contacts: int
    """How many."""
    approach: float
    """One over the step in which no node passes more than half of a tet that it meets, or will in the next step,
    1/s."""
    opening: Ints
    """Rows of the cracks that have become so wide that they open."""
    stray: bool
    """Whether a slot will have strayed so far in the next step that it is registered anew; of any rank, once they have
    agreed on the step."""

    @classmethod
    def nothing(cls) -> "Detected":
        """Before the first step."""
        return cls(0, 0.0, np.zeros(0, np.int64), False)


@dataclass(frozen=True)
class Ahead:
    """How far ahead contacts are found."""

    dt: float
    """The step ahead, s."""
    most: float
    """The longest step that may follow it, s."""
    size: float
    """The typical one of a face, m."""
    rebound: float
    """See narrow_phase.Step."""

    def beyond(self, v: Floats) -> float:
        """The step that follows if in it anything of ``v`` (slots, 3) may come nearer to anything by HASTY of a face;
        else 0. No such pair is bounded, so that a rank where nothing is so fast need not know of any.
        """
        fastest = spread(v)
        return self.most if fastest * self.most > HASTY * self.size else 0.0


def detect(
    now: Scene, surface: Exterior, mu: Floats, give: float, ahead: Ahead, redraw: bool, together: bool
) -> Detected:  # fmt: skip
    """The active contacts of the step ahead, of the positions and velocities of the scene's nodes.

    ``surface``: of this rank; ``mu`` (parts, parts): friction, NaN where two parts do not meet; ``give``: see
    narrow_phase.PUSH_OUT; ``redraw``: whether short lines are drawn anew (tracks.py); ``together``: whether some rank
    registers what has strayed.
    """
    crowd, tracks = now.crowd, now.tracks
    beyond = ahead.beyond(crowd.v)
    tracks.advance(ahead.dt, beyond)
    if redraw:
        tracks.shorten(crowd.x)
        now.node_face.wake()
        now.edge_edge.wake()
    tracks.measure(crowd.x, crowd.v, now.faces.corners, now.edges.corners)
    stray = _renewed(now, together)
    step = Step.of(crowd.x, crowd.v, crowd.part, mu, give, ahead.dt, now.step_room)
    inside = surface.entering(now, step)
    now.reserve(sum(len(nodes) for nodes, _ in inside))
    step = step.followed(beyond, HASTY * ahead.size, ahead.rebound, now.face_table())
    contacts, approach, opening = _test(now, step, ahead.size, inside)
    return Detected(contacts, approach, opening, stray)


def _renewed(now: Scene, together: bool) -> bool:
    """Registers what has to be; whether in the next step something will have strayed too far, if it goes on so."""
    tracks, most, before = now.tracks, 0.5 * now.rules.skin, now.tracks.strayed
    tracks.strayed = tracks.farthest(now.slots.tracked)
    due = tracks.strayed > (_JOIN if together else 1.0) * most
    if due or now.pending:
        registration.renew(now, now.crowd.x, now.crowd.v, due)
        before = tracks.strayed = tracks.farthest(now.slots.tracked)
    return 2.0 * tracks.strayed - before > most


def _test(now: Scene, step: Step, size: float, inside: list[tuple[Indices, Floats]]) -> tuple[int, float, Ints]:
    """The narrow phase: contacts, approach and opening of ``Detected``; ``inside``: see Exterior.entering."""
    tracks, faces, pairs = now.tracks, now.face_table(), now.node_face.arrays()
    n, tested, coming = node_face(now.active.room, 0, pairs, now.slot_table(), faces, step, tracks.end)
    now.node_face.tested = pairs.active[:tested]
    limit = _KINEMATIC * max(coming, approach(now.active.room, n, pairs, faces, step))
    pairs = now.edge_edge.arrays()
    n, tested = edge_edge(now.active.room, n, pairs, now.edge_table(), step, tracks.short.course, tracks.end)
    now.edge_edge.tested = pairs.active[:tested]
    now.faces.fresh[:], now.edges.fresh[:], now.slots.fresh[:] = False, False, False
    opening = np.empty(len(now.cracks), np.int64)
    n, wide = across(now.active.room, n, opening, now.cracks, size, step)
    for nodes, weights in inside:
        n = pushed_out(now.active.room, n, nodes, weights, step)
    return int(n), float(limit), opening[:wide]
