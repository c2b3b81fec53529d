"""Brittle parts that an impact compresses further than a law of tension alone can mean.

A material with ``brittle`` and without ``strength`` breaks in tension and bears any compression: it becomes a column
that nothing crushes. Griffith's criterion (1924) says from which compression on cracks grow in matter of the same
tensile strength T: (s1 - s3)^2 = 8 T (s1 + s3) for the largest and the smallest pressure, s1 and s3, where
s1 + 3 s3 > 0. In the plane wave of an impact nothing moves aside, so that s3 = k s1, k = nu / (1 - nu), and

    s1 = 8 T (1 + k) / (1 - k)^2

20 T for nu = 0.22; alumina of 300 MPa and nu = 0.22 has 6.0 GPa, and a Hugoniot elastic limit of 6.6 GPa is measured
(alumina_995_jh2 in materials.toml). Along a bar, which may move aside, it is 8 T.
"""

import itertools
import math
from collections.abc import Iterator, Sequence

from ..estimates.impact import apart, velocities, wave_speed
from ..figures import counted, si
from ..model.boundaries import Wall
from ..model.materials import Material
from ..model.schema import Case
from ..outcome import Compressed
from ..reading.library import library, material
from ..reading.problems import Problem, problem

CRUSHING = ("mohr_coulomb", "johnson_holmquist")
"""Laws of strength under which brittle matter fails in compression, too."""


def bears_all(made: Material) -> bool:
    """Whether it breaks in tension alone and bears any compression."""
    return made.brittle is not None and made.strength is None


def griffith(made: Material) -> float:
    """The stress of a plane wave, Pa, from which on compression breaks a material with ``brittle``."""
    assert made.brittle is not None
    k = made.elastic.poisson / (1.0 - made.elastic.poisson)
    return 8.0 * made.brittle.strength * (1.0 + k) / (1.0 - k) ** 2


def impact_stresses(case: Case) -> list[float]:
    """The largest stress, Pa, of the plane wave that an impact may send into each part: Z1 Z2 / (Z1 + Z2) times the
    speed at which it may meet another one (impact.impact_speeds), Z1 times that for a wall.
    """
    bounds = [velocities(case, part) for part in case.parts]
    weights = [_impedance(material(case, part.material)) for part in case.parts]
    found = [0.0] * len(bounds)
    for (i, own), (j, other) in itertools.permutations(enumerate(bounds), 2):
        found[i] = max(found[i], apart(*own, *other) / (1.0 / weights[i] + 1.0 / weights[j]))
    for _, wall in case.boundaries_of(Wall):
        its = wall.velocity, wall.velocity
        found = [max(old, z * apart(*own, *its)) for old, z, own in zip(found, weights, bounds, strict=True)]
    return found


def _impedance(made: Material) -> float:
    """Density times the speed of plane waves, kg/m^2/s; of the bulk alone where the matter flows."""
    flows = made.strength is not None and made.brittle is None
    return made.density * (math.sqrt(made.bulk / made.density) if flows else wave_speed(made))


def crushed(case: Case) -> Iterator[Problem]:
    """A warning for each material of tension alone that may be compressed beyond Griffith's criterion, at the part that
    is compressed most.
    """
    most: dict[str, tuple[float, int]] = {}
    for i, (part, stress) in enumerate(zip(case.parts, impact_stresses(case), strict=True)):
        if stress > most.get(part.material, (0.0, i))[0]:
            most[part.material] = stress, i
    for name, (stress, i) in most.items():
        made = material(case, name)
        if not bears_all(made) or stress <= griffith(made):
            continue
        alike = f" ({', '.join(_alike(name))})" if _alike(name) else ""
        met = f"{case.parts[i].name!r} may be compressed with {stress * 1e-9:.2g} GPa by an impact"
        crush = (
            f"of this tensile strength is crushed from {griffith(made) * 1e-9:.2g} GPa on (Griffith 1924, plane wave)"
        )
        yield problem(
            ("materials", name, "strength"), "none",
            f"{met}; without strength it breaks in tension alone and bears any compression, where matter {crush}: "
            f"{_cure()}{alike}",
        )  # fmt: skip


def borne(found: Sequence[Compressed]) -> list[str]:
    """A warning for each part that a run has compressed beyond the criterion."""
    return [
        f"{each.part} has met a compression of {si(each.most, 'Pa')}, with {si(each.least, 'Pa')} across it, "
        f"{each.times:.2g} times what cracks matter of its tensile strength (Griffith 1924), in tet {each.tet} at "
        f"({each.x:.4g}, {each.y:.4g}, {each.z:.4g}) m, at {each.time:.4g} s; at most {counted(each.tets, 'tet')} were "
        f"beyond that at once. No law of its material fails in compression, and it has borne it: {_cure()}"
        for each in found
        if each.times > 1.0
    ]


def _cure() -> str:
    return f"strength.model = {' or '.join(repr(law) for law in CRUSHING)} can fail so"


def _alike(name: str) -> list[str]:
    """Materials of the library that begin with the same name and fail in compression."""
    return sorted(
        known for known, made in library().items()
        if known.startswith(name.partition("_")[0]) and made.strength is not None and made.strength.model in CRUSHING
    )  # fmt: skip
