"""Warnings about probes of a residual velocity whose part still moves towards the plane at the end of a run."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from ..figures import exact
from ..model.measures import Probe
from ..model.schema import Case

SHARE = 0.1
"""Least fraction of the mass of a part for which a warning is given; less mass is debris (chosen value)."""
SLOW = 0.05
"""Speed of a stopped part, divided by the largest initial speed of the case: a stopped part vibrates with the target,
which has some per cent of the speed of the projectile (chosen value)."""


@dataclass(frozen=True)
class Before:
    """Material of a probe that has not reached the plane of the probe."""

    share: float
    """Mass of this material divided by the mass of all material of the probe."""
    speed: float
    """Mean velocity of this material towards the plane, m/s."""


def unreached(case: Case, found: Mapping[int, Before]) -> Iterator[str]:
    """Yields a warning for each probe in ``found`` (number of the probe: material before its plane) with material that
    still moves towards the plane.
    """
    fastest = max(sum(float(c) ** 2 for c in part.velocity) ** 0.5 for part in case.parts)
    for k, before in sorted(found.items()):
        if before.share >= SHARE and fastest > 0.0 and before.speed > SLOW * fastest:
            yield _text(k, case.probes[k], before)


def _text(k: int, probe: Probe, before: Before) -> str:
    assert probe.beyond is not None
    return (
        f"probes[{k}], {probe.name!r}: at the end {100.0 * before.share:.0f} % of the mass of {probe.part!r} has not "
        f"reached the plane {probe.beyond.axis} = {exact(probe.beyond.at, 'm')} and moves towards it at "
        f"{exact(before.speed, 'm/s', 3)}; the value does not include this mass, and is no residual velocity yet: "
        "increase run.end_time"
    )
