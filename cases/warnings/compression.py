"""Warnings about brittle parts that are compressed beyond their strength although their material has no law of
compressive failure.

A material with the table ``brittle`` and without the table ``strength`` breaks in tension only and resists any
compression. No real material does this. Griffith's criterion (1924) gives the compression at which cracks grow in a
material with the tensile strength T: (s1 - s3)^2 = 8 T (s1 + s3), if s1 + 3 s3 > 0; s1 is the largest and s3 the
smallest principal pressure. The plane wave of an impact has no lateral strain. With Poisson's ratio nu this gives s3 =
k s1, k = nu / (1 - nu), and

    s1 = 8 T (1 + k) / (1 - k)^2

For nu = 0.22 the criterion is reached at s1 = 20 T. Example: alumina with T = 300 MPa and nu = 0.22 has s1 = 6.0 GPa;
its measured Hugoniot elastic limit is 6.6 GPa (alumina_995_jh2 in materials.toml). In a bar under uniaxial compression,
Griffith's criterion is reached at 8 times the tensile strength T.
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
"""Laws of strength with which brittle material can also fail in compression."""


def bears_all(made: Material) -> bool:
    """Whether the material can break in tension only and resists any compression."""
    return made.brittle is not None and made.strength is None


def griffith(made: Material) -> float:
    """Returns the stress of a plane wave, Pa, at which a material with the table ``brittle`` reaches Griffith's
    criterion.
    """
    assert made.brittle is not None
    k = made.elastic.poisson / (1.0 - made.elastic.poisson)
    return 8.0 * made.brittle.strength * (1.0 + k) / (1.0 - k) ** 2


def impact_stresses(case: Case) -> list[float]:
    """Returns, for each part, the largest stress of the plane wave of an impact, Pa. The stress is the impact speed
    (impact.impact_speeds) times Z1 Z2 / (Z1 + Z2), where Z1 and Z2 are the impedances of the part and of the part that
    it hits; for an impact on a wall, the stress is the impact speed times Z1.
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
    """Impedance of plane waves, kg/m^2/s: density times wave speed. For a material that yields, the wave speed is the
    bulk sound speed.
    """
    flows = made.strength is not None and made.brittle is None
    return made.density * (math.sqrt(made.bulk / made.density) if flows else wave_speed(made))


def crushed(case: Case) -> Iterator[Problem]:
    """Yields a warning for each material that breaks in tension only and can be compressed beyond Griffith's criterion
    in the case. The warning names the part with the largest compression.
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
        met = f"{case.parts[i].name!r} may be compressed to {stress * 1e-9:.2g} GPa by an impact"
        crush = (
            f"of this tensile strength is crushed from {griffith(made) * 1e-9:.2g} GPa on (Griffith 1924, plane wave)"
        )
        yield problem(
            ("materials", name, "strength"), "none",
            f"{met}; without strength it breaks in tension only and resists any compression, while material {crush}: "
            f"{_cure()}{alike}",
        )  # fmt: skip


def borne(found: Sequence[Compressed]) -> list[str]:
    """Returns a warning for each part that was compressed beyond Griffith's criterion in a run."""
    return [
        f"{each.part} was compressed to {si(each.most, 'Pa')}, with {si(each.least, 'Pa')} across it, "
        f"{each.times:.2g} times the limit for its tensile strength (Griffith 1924), in tet {each.tet} at "
        f"({each.x:.4g}, {each.y:.4g}, {each.z:.4g}) m, at {each.time:.4g} s; at most {counted(each.tets, 'tet')} were "
        f"beyond that at the same time. Its material has no compressive failure: {_cure()}"
        for each in found
        if each.times > 1.0
    ]


def _cure() -> str:
    return f"strength.model = {' or '.join(repr(law) for law in CRUSHING)} can fail in compression"


def _alike(name: str) -> list[str]:
    """Returns the materials of the library that have a similar name and can fail in compression."""
    return sorted(
        known for known, made in library().items()
        if known.startswith(name.partition("_")[0]) and made.strength is not None and made.strength.model in CRUSHING
    )  # fmt: skip
