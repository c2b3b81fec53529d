"""Ratio of the first time step of a run to its mean time step: impact and pressure flatten tets and make waves faster,
which reduces the time step.
"""

import math
from collections.abc import Sequence

from ..model.bodies import Tube
from ..model.boundaries import Around, Traction
from ..model.courses import Course, factor_at
from ..model.materials import Material
from ..model.schema import Case, Part, Symmetry
from ..model.solids import Measured
from ..reading.library import material
from ..shapes.geometry import AXES, bounds
from .impact import wave_speed

DEEPEST, DEEPEST_ERODING = 12.0, 4.0
"""Largest ratio for a body that is crushed, and for a part with erosion. The second value is smaller because erosion
deletes the flattest tets."""
FOOT, SLENDER = 0.9, 4.5
"""Factor of k, and largest ratio of length to width, in the function ``shrinkage``."""
CROSSINGS = 2.0
"""Duration of a shock in a part, divided by the extent of the part over the impact speed. Measured: in a collision of
two copper balls of 1 mm at 10 km/s (cases/hard/head_on_10km.toml) the time step is short during 0.2 us."""


def shrinkage(case: Case, part: Part, speed: float) -> float:
    """Returns the first time step divided by the mean time step of a part that is hit at ``speed``, m/s: impact
    flattens the tets, and compression makes waves faster.

    A metal that flows and is stopped from the speed v reaches the mean strain density v^2 / (2 yield stress). The
    struck end of the part, about as long as it is wide, takes the strain of the whole length. The mean time step
    decreases as exp(-k strain) with k = 0.9 length / width, at most 4 (``slenderness``). Measured: square bars that are
    1, 2 and 4 times as long as wide have k up to 0.9, 1.8 and 2.8, less with strong hardening (``python -m
    tests.bench.flattening``); Taylor bars of copper and steel have k = 4. A shock compresses a part that is enclosed.
    """
    made = material(case, part.material)
    deepest = DEEPEST if part.erosion is None else DEEPEST_ERODING
    if _confined(case, part):
        shock = made.eos.c0 + made.eos.S * speed if made.eos is not None else wave_speed(made)
        faster = 1.0 + 2.0 * made.eos.S * speed / made.eos.c0 if made.eos is not None else 1.0
        return min(deepest, faster / (1.0 - min(speed / shock, 0.9)))
    if made.strength is None:
        return 1.0
    strain = made.density * speed**2 / (2.0 * made.strength.flow_stress())
    flattened = math.exp(min(FOOT * slenderness(case) * strain, 10.0))
    imploded = max((_imploded(case, part, made, load) for load in _on_part(case, part)), default=1.0)
    return max(_shocked(case, part, made, speed, flattened), min(deepest, imploded))


def _shocked(case: Case, part: Part, made: Material, speed: float, flattened: float) -> float:
    """Returns the reduction of the time step of a part that an impact shocks or flattens. Material behind the shock
    front moves at u = speed / 2. Waves there are about 2 S u faster than c0 (S: slope of the Hugoniot) until the shock
    has crossed the part. During this time a tet of a part with erosion flattens up to its limit strain; later the flat
    tets are deleted.
    """
    body = None if isinstance(part.mesh, Measured) else bounds(part.mesh)
    if part.erosion is None:
        return min(DEEPEST, flattened)
    later = min(DEEPEST_ERODING, flattened)
    if made.eos is None or part.erosion.plastic_strain is None or body is None or not speed:
        return later
    leaves = min(math.exp(min(part.erosion.plastic_strain, 10.0)), 1.0 / part.erosion.time_step)
    extent = max(high - low for low, high in zip(*body, strict=True))
    share = min(1.0, CROSSINGS * extent / (speed * case.run.end_time))
    faster = 1.0 + made.eos.S * speed / made.eos.c0
    return share * faster * min(leaves, flattened) + (1.0 - share) * later


def _on_part(case: Case, part: Part) -> list[Traction]:
    loads = [load for _, load in case.boundaries_of(Traction)]
    return [load for load in loads if load.on is None and (not load.parts or part.name in load.parts)]


def _imploded(case: Case, part: Part, made: Material, load: Traction) -> float:
    """Returns the reduction of the time step of a tube under an external ``load``, Pa, above its collapse pressure Y
    ln(outer / inner radius), with the yield stress Y.

    The wall moves inwards freely at constant cross-section. Material at the bore reaches the hoop strain ln(first
    radius / present radius). If the bore closes, the tets of the tube flatten without limit.
    """
    tube, flow = part.mesh, made.strength.flow_stress() if made.strength is not None else math.inf
    if not isinstance(tube, Tube) or load.pressure is None or not _outside(tube, load.cylinder):
        return 1.0
    area = tube.radius**2 - tube.inner_radius**2
    more = load.pressure - flow * math.log(tube.radius / tube.inner_radius)
    pace = more * tube.radius / (made.density * area / 2.0)
    outer = tube.radius - pace * _moved(load.course, case.run.end_time)
    bore = outer**2 - area if outer > 0.0 else 0.0
    return 1.0 if more <= 0.0 else math.inf if bore <= 0.0 else tube.inner_radius / math.sqrt(bore)


def _outside(tube: Tube, region: Around | None) -> bool:
    """Whether the region contains the outer surface of the tube but not its bore."""
    return region is not None and tube.inner_radius < region.inner_radius <= tube.radius <= region.radius


def _moved(course: Course, until: float) -> float:
    """Displacement after the time ``until``, m, for an acceleration of 1 m/s^2 times the factor of the course."""
    times = [until * n / 100 for n in range(101)]
    factors = [factor_at(course, time) for time in times]
    return sum((until - time) * factor for time, factor in zip(times, factors, strict=True)) * until / 100


def slenderness(case: Case) -> float:
    """Returns the largest ratio of length to width of all parts, limited to 1 to SLENDER; with a mesh file the result
    is SLENDER. The length is the largest extent of a part, and the width is the mean of its other two extents. The
    largest ratio counts for all parts because a slender part also strains the part that it hits.
    """
    most = 1.0
    for part in case.parts:
        body = None if isinstance(part.mesh, Measured) else bounds(part.mesh)
        if body is None:
            return SLENDER
        wide, broad, length = sorted(high - low for low, high in zip(*body, strict=True))
        most = max(most, length / math.sqrt(wide * broad))
    return min(most, SLENDER)


def _confined(case: Case, part: Part) -> bool:
    """Whether planes of symmetry confine a part on both sides in two directions."""
    body = None if isinstance(part.mesh, Measured) else bounds(part.mesh)
    if body is None:
        return False
    planes = [
        (boundary.axis, boundary.at)
        for boundary in case.boundaries
        if isinstance(boundary, Symmetry)
        and boundary.on is None
        and (not boundary.parts or part.name in boundary.parts)
    ]
    held = [all(_on(planes, d, side[d]) for side in body) for d in range(3)]
    return sum(held) >= 2


def _on(planes: Sequence[tuple[str, float]], direction: int, at: float) -> bool:
    return any(axis == AXES[direction] and math.isclose(where, at, abs_tol=1e-9) for axis, where in planes)
