"""Warnings about a valid case that may contain a wrong unit: numbers without a unit, and values outside of the usual
range.
"""

import math
from collections.abc import Iterator, Mapping
from itertools import chain
from typing import Any

from ..checks.overlap import grazes
from ..estimates.estimate import Estimate
from ..estimates.impact import impact_speeds, wave_speed
from ..model.materials import Material
from ..model.schema import Case
from ..reading.library import material
from ..reading.problems import Location, Problem, problem
from ..reading.quantities import unit_of_reference
from ..reference.json_schema import Schema, definition, shipped_schema, variants
from ..units import QUANTITY
from .approach import strangers
from .compression import crushed
from .contradicted import contradicted
from .damping import damped
from .driven import passing
from .idle import unloaded
from .mirrored import mirrored
from .reach import cut_bodies, scant_probes
from .stiff import stiff
from .unused import unused

DAY = 86_400.0
"""Core time of a run above which it gives a warning: a day, s (chosen value)."""
FEW_STEPS = 10
"""Smallest number of time steps of a run without a warning (chosen value). A wave crosses a tet in about two time
steps. If the run ends before a wave has crossed five tets, it has no useful result. The usual cause is a wrong unit of
a mesh file."""
LIKELY: dict[str, tuple[float, float, str]] = {
    "density": (10.0, 23_000.0, "kg/m^3: foams have 10, osmium has 22,590"),
    "wave speed": (20.0, 20_000.0, "m/s: soft rubber has 30, diamond has 18,000"),
    "yield stress over Young's modulus": (1e-6, 0.1, "ideal crystals yield at a tenth"),
    "tensile strength over Young's modulus": (1e-7, 0.1, "ideal crystals break at a tenth"),
    "specific heat": (50.0, 15_000.0, "J/kg/K: tungsten has 134, hydrogen 14,300"),
    "fracture energy": (1e-2, 1e6, "J/m^2: glass has 8, tough steel 100,000"),
    "temperature": (100.0, 6_000.0, "K: 20 degrees Celsius are 293 K"),
    "extent": (1e-6, 5.0, "m: a mesh in mm that was read as m is a thousand times too large"),
    "bulk modulus, density c0^2, over that of elastic,": (0.5, 2.0, "both are of one solid at rest"),
}
"""Usual ranges of the properties of solids: smallest value, largest value, and known materials near these values (from
handbooks)."""
SHOCKING = 0.1
"""Impact speed divided by the wave speed above which a material with linear pressure gives a warning. In an impact
between two bodies of the same material the particle speed is u = v / 2. At this limit the linear pressure is then some
7 % too low, and 13 % too low if the other body does not yield. The pressure of a shock is p = density (c0 + s u) u,
where s is near 1.5 for metals (1.2 to 1.9 in materials.toml). The linear pressure -K ln J gives p = density (c0 + u /
4) u."""
STIFFENING, LINEAR_STIFFENING = 1.5, 0.25
"""Increase of the shock speed per particle speed u: the slope s of metals, and the slope of the linear pressure."""
_UNLIKE = 1000.0
"""Largest ratio of the sizes of two parts without a warning. The limit finds a length in millimetres that was read as
metres (reason of the chosen value)."""


def doubts(data: Mapping[str, Any], case: Case, expected: Estimate) -> list[Problem]:
    """Returns every warning about a case. ``data``: the case as it was written; ``expected``: the estimate of the
    case.
    """
    return [*bare_numbers(data), *oddities(case, expected)]


def oddities(case: Case, expected: Estimate) -> list[Problem]:
    """Returns the warnings that do not depend on how the case is written."""
    return [
        *_effort(case, expected),
        *_materials(case),
        *_bodies(case, expected),
        *_shocks(case),
        *crushed(case),
        *damped(case),
        *grazes(case),
        *strangers(case),
        *passing(case),
        *contradicted(case),
        *mirrored(case),
        *unused(case),
        *unloaded(case),
        *cut_bodies(case),
        *stiff(case, expected),
        *scant_probes(case, expected),
    ]


# Bare numbers ---------------------------------------------------------------------------------------------------------


def bare_numbers(data: Mapping[str, Any]) -> list[Problem]:
    """Returns a warning for each key that has a number other than 0 without a unit. The warning gives the unit that is
    assumed.
    """
    whole = shipped_schema()
    return list(_bare((), data, whole, whole, data))


def _bare(location: Location, value: Any, schema: Schema, whole: Schema, data: Mapping[str, Any]) -> Iterator[Problem]:
    for meant in (definition(variant, whole) for variant in variants(schema)):
        if "properties" in meant and isinstance(value, Mapping) and _is(meant, value):
            inner = ((key, value[key], each) for key, each in meant["properties"].items() if key in value)
        elif "patternProperties" in meant and isinstance(value, Mapping):
            inner = ((key, each, next(iter(meant["patternProperties"].values()))) for key, each in value.items())
        elif "items" in meant and isinstance(value, list | tuple):
            inner = ((i, each, meant["items"]) for i, each in enumerate(value))
        else:
            yield from _taken(location, value, meant, data)
            continue
        yield from chain.from_iterable(_bare((*location, key), each, to, whole, data) for key, each, to in inner)


def _is(schema: Schema, value: Mapping[str, Any]) -> bool:
    """Whether a table of the case is the variant that the schema describes."""
    consts = {key: each["const"] for key, each in schema["properties"].items() if "const" in each}
    return all(value.get(key) == const for key, const in consts.items())


def _taken(location: Location, value: Any, schema: Schema, data: Mapping[str, Any]) -> Iterator[Problem]:
    listed = isinstance(value, list | tuple)
    values, schemas = (value, schema.get("prefixItems", ())) if listed else ([value], [schema])
    bare = [to["unit"] for each, to in zip(values, schemas, strict=False) if to.get("unit") and _bare_number(each)]
    unit = next(iter(bare), "")
    if unit == QUANTITY:
        unit = unit_of_reference(data, location)
    if unit:
        shown = f"[{', '.join(map(str, values))}]" if listed else f"{float(value):g}"
        yield Problem(
            problem(location, ..., "").key, shown, f"no unit, taken for {unit if listed else f'{shown} {unit}'}"
        )


def _bare_number(value: Any) -> bool:
    """Whether a value is a number other than 0 without a unit, as number or as text."""
    try:
        return not isinstance(value, bool) and float(value) != 0.0
    except (TypeError, ValueError):
        return False


# Unusual values
# ----------------------------------------------------------------------------------------------------------


def _effort(case: Case, expected: Estimate) -> Iterator[Problem]:
    end, where = case.run.end_time, ("run", "end_time")
    if expected.dt is not None and end < expected.dt:
        yield problem(where, f"{end:g} s", f"is shorter than the first time step, {expected.dt:.3g} s")
    elif expected.dt is not None and end < FEW_STEPS * expected.dt:
        few = f"is {end / expected.dt:.2g} time steps of {expected.dt:.3g} s: no wave crosses more than a few tets"
        yield problem(where, f"{end:g} s", few)
    if expected.steps is None or expected.core_seconds is None:
        return
    if expected.steps >= case.run.max_steps:
        yield problem(("run", "max_steps"), case.run.max_steps, f"will be reached before run.end_time, {end:g} s")
    if expected.core_seconds > DAY:
        hours = expected.core_seconds / 3600.0
        yield problem(where, f"{end:g} s", f"takes about {expected.steps:.2g} steps and {hours:.3g} hours of core time")


def _materials(case: Case) -> Iterator[Problem]:
    for name, made in case.materials.items():
        for key, what, value in _constants(made):
            yield from _unlikely(("materials", name, *key), what, value)
        if made.spall is not None and made.brittle is not None and made.spall < made.brittle.strength:
            strength = f"brittle.strength, {made.brittle.strength:.3g} Pa: under tension from all sides no facet breaks"
            yield problem(("materials", name, "spall"), f"{made.spall:.3g} Pa", f"pores open below {strength}")


def _constants(made: Material) -> Iterator[tuple[Location, str, float]]:
    yield ("density",), "density", made.density
    yield ("elastic", "young"), "wave speed", wave_speed(made)
    if made.strength is not None:
        for key, what, value in made.strength.likely(made.elastic.young):
            yield ("strength", key), what, value
    if made.brittle is not None:
        yield (
            ("brittle", "strength"),
            "tensile strength over Young's modulus",
            made.brittle.strength / made.elastic.young,
        )
        yield ("brittle", "energy"), "fracture energy", made.brittle.energy
    if made.eos is not None:
        yield ("eos", "c0"), "bulk modulus, density c0^2, over that of elastic,", made.bulk / made.elastic.bulk


def _unlikely(location: Location, what: str, value: float) -> Iterator[Problem]:
    low, high, known = LIKELY[what]
    if not low <= value <= high:
        end = f"below {low:g}" if value < low else f"above {high:g}"
        yield problem(location, ..., f"a {what} of {value:.3g} is {end} ({known})".replace("a extent", "an extent"))


def _bodies(case: Case, expected: Estimate) -> Iterator[Problem]:
    sizes: dict[int, float] = {}
    for i, (part, size) in enumerate(zip(case.parts, expected.parts, strict=True)):
        yield from _unlikely(("parts", i, "temperature"), "temperature", part.temperature)
        if size.bulk is None:
            continue
        sizes[i] = max(size.bulk.extent)
        yield from _unlikely(("parts", i, "mesh"), "extent", sizes[i])
        wave = wave_speed(material(case, part.material))
        if size.bulk.speed > wave:
            than = f"faster than waves in {part.material}, {wave:.3g} m/s"
            message = f"{part.name!r} moves at {size.bulk.speed:.3g} m/s, {than}"
            yield problem(("parts", i, "velocity"), ..., message)
    if sizes and max(sizes.values()) > _UNLIKE * min(sizes.values()):
        large, small = (pick(sizes, key=lambda i: sizes[i]) for pick in (max, min))
        names = f"{case.parts[large].name!r} is {sizes[large] / sizes[small]:.0f} times as large as"
        yield problem(
            ("parts", small, "mesh"), ..., f"{names} {case.parts[small].name!r}, which has {sizes[small]:.3g} m"
        )


def _shocks(case: Case) -> Iterator[Problem]:
    """Yields a warning for each material with linear pressure that an impact hits too fast. The warning names the part
    that is hit at the highest speed.
    """
    met: dict[str, tuple[float, int]] = {}
    for i, (part, speed) in enumerate(zip(case.parts, impact_speeds(case), strict=True)):
        fastest, _ = met.get(part.material, (0.0, i))
        if speed > fastest:
            met[part.material] = speed, i
    for name, (speed, i) in met.items():
        made = material(case, name)
        own = made.eos is not None or (made.strength is not None and made.strength.own_pressure)
        share = speed / wave_speed(made)
        if share > SHOCKING and not own:
            low = 100.0 * linear_error(math.sqrt(made.bulk / made.density), 0.5 * speed)
            shock = f"{low:.0f} % below that of a shock, density (c0 + s u) u, s = {STIFFENING:g}, u half that speed"
            fast = f"may be hit at {speed:.3g} m/s, {share:.2g} of its wave speed"
            message = f"{fast}, without eos: linear pressure is some {shock}"
            yield problem(("parts", i, "material"), name, message)


def linear_error(c0: float, u: float) -> float:
    """Returns the fraction by which the linear pressure is below the pressure of a shock with the particle speed ``u``,
    m/s. ``c0``: bulk sound speed, m/s.
    """
    return (STIFFENING - LINEAR_STIFFENING) * u / (c0 + STIFFENING * u)
