"""Requirements of the project with the measured values. The benchmark reports failed requirements, but does not
fail."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from .accuracy import Answer
from .contact_cost import Cost
from .fracture_cost import Armed, Shattered
from .growth import Growth
from .long_rod import BANDS, LENGTH, Shot
from .speed import Speed
from .startup import Startup
from .switch import Pairs
from .table import table
from .taylor_cost import Stage, mean_speed

_LOCKS = {"taylor_copper": (0.54, 6.0), "taylor_42crmo4": (0.8, 4.5)}
"""Element size and largest foot radius of each bar with the standard pressure form, mm. Locking decreases with the
element size; the limit of the steel bar, a diameter of 9 mm, holds for a mesh of 3,840 tets."""


@dataclass(frozen=True)
class Gate:
    """One requirement."""

    what: str
    wanted: str
    measured: str
    met: bool


def of_speed(speeds: Sequence[Speed]) -> Iterator[Gate]:
    """Yields the requirements for elastic material, at 136,000 to 150,000 tets."""
    for s in speeds:
        if (s.material, s.form) == ("elastic", "standard") and 1.3e5 < s.tets < 1.6e5:
            yield Gate(f"elastic, {s.tets:,} tets", ">= 12 M updates / CPU-s", f"{s.best:.1f} M", s.best >= 12.0)
            yield Gate(f"elastic, {s.tets:,} tets", ">= 25 % of gather-scatter", f"{s.share:.0%}", s.share >= 0.25)


def of_taylor(stages: Sequence[Stage]) -> Iterator[Gate]:
    """Yields the requirement for Johnson-Cook material with nodal pressure, mean over the bar."""
    best, _ = mean_speed(stages)
    what = f"Johnson-Cook, nodal, Taylor bar, {stages[0].tets:,} tets"
    yield Gate(what, ">= 4 M updates / CPU-s", f"{best:.2f} M", best >= 4.0)


def of_growth(sizes: Sequence[Growth]) -> Iterator[Gate]:
    """Yields the requirements on growth for elastic material: memory between the first and the last size, and cost per
    tet over all sizes."""
    sizes = [s for s in sizes if not s.armed]
    peak, steady = sizes[-1].bytes_a_tet(sizes[0])
    yield Gate("memory, elastic, while it is set up", "<= 400 bytes a tet", f"{peak:.0f}", peak <= 400.0)
    yield Gate("memory, elastic, while it steps", "<= 400 bytes a tet", f"{steady:.0f}", steady <= 400.0)
    worst = max(s.best for s in sizes) / min(s.best for s in sizes)
    span = f"cost a tet, {sizes[0].tets:,} to {sizes[-1].tets:,} tets, dearest / cheapest"
    yield Gate(span, "<= 1.30", f"{worst:.2f}", worst <= 1.3)


def of_startup(startup: Startup) -> Iterator[Gate]:
    """Yields the requirements on the start-up: time of a warm start, and number of compilations."""
    yield Gate("submit to first step, warm", "<= 3 s", f"{startup.submitted:.2f} s", startup.submitted <= 3.0)
    themselves = sum(startup.compiled.values())
    yield Gate("kernels that ranks compile themselves", "0", str(themselves), themselves == 0 < startup.ahead)


def of_accuracy(answers: Sequence[Answer]) -> Iterator[Gate]:
    """Yields the requirements on the shipped Taylor bars with 12,960 tets, and on a control that must fail."""
    for a in answers:
        if a.plan.safety != 0.9 or a.plan.generator != "structured" or not a.plan.viscosity:
            continue
        if a.plan.form == "standard" and a.plan.size == _LOCKS[a.plan.bar][0]:
            yield _locks(a)
        if a.plan.size == 0.54:
            if a.problem:
                yield Gate(_named(a), "runs to its end", a.problem, False)
            if a.plan.form != "standard":
                yield from _shape(a)
            yield Gate(f"{_named(a)}, energy residual", "< 1 %", f"{a.residual:.1e}", a.residual < 0.01)


def _named(a: Answer) -> str:
    return f"{a.plan.bar}, {a.plan.form}, {a.tets:,} tets"


def _shape(a: Answer) -> Iterator[Gate]:
    for name, unit in (("extent", "length"), ("radius", "radius")):
        for check in (c for c in a.checks if c.name.startswith(name)):
            wanted = f"{1000 * check.expected:.3f} +- {1000 * check.tolerance:.3f} mm"
            yield Gate(f"{_named(a)}, {unit}", wanted, f"{1000 * check.value:.3f} mm", check.passed)


def _locks(a: Answer) -> Gate:
    _, limit = _LOCKS[a.plan.bar]
    radius = 1000 * a.value("radius")
    return Gate(f"{_named(a)} locks, radius", f"< {limit} mm", f"{radius:.3f} mm", radius < limit)


def of_telemetry(costs: Sequence[Pairs], digests: Mapping[str, str]) -> Iterator[Gate]:
    """Yields the requirements on telemetry: the cost with telemetry over the cost without telemetry."""
    for cost in costs:
        ratio, _, _ = cost.ratio("cpu")
        change = f"{100 * (ratio - 1):+.2f} %"
        yield Gate(f"telemetry, router {cost.way}: CPU time a step", "within 1 %", change, abs(ratio - 1) <= 0.01)
    if digests:
        count = len(set(digests.values()))
        yield Gate("telemetry: digests over all ways", "1", str(count), count == 1)


def report(gates: Sequence[Gate]) -> str:
    """Returns one line of text for each requirement."""
    rows = [[gate.what, gate.wanted, gate.measured, "yes" if gate.met else "NO"] for gate in gates]
    return table(["what", "wanted", "measured", "met"], rows) + "\n"


def of_long_rod(shots: Sequence[Shot]) -> Iterator[Gate]:
    """Yields the requirements on the long rod: range of P/L, change with the mesh, and wall time."""
    found = {shot.variant.name: shot for shot in shots}
    for speed, (low, high) in BANDS.items():
        if speed in found:
            share = found[speed].depth / LENGTH
            yield Gate(f"long rod, P/L at {speed}", f"{low:.2f} to {high:.2f}", f"{share:.3f}", low <= share <= high)
    if "1 mm" in found and "0.7 mm" in found:
        change = abs(found["0.7 mm"].depth / found["1 mm"].depth - 1.0)
        yield Gate("long rod, P from 1 mm to 0.7 mm", "< 5 %", f"{change:.1%}", change < 0.05)
    if "1 mm" in found:
        outcome = found["1 mm"].outcome
        wall = outcome.elapsed - outcome.setup
        yield Gate("long rod, 1 mm, 2 ranks", "< 600 s", f"{wall:.0f} s", wall < 600.0)
        share = sum(outcome.phases["contact"]) / sum(outcome.phases["elements"])
        yield Gate("long rod, contact over elements", "<= 1", f"{share:.2f}", share <= 1.0)


def of_fracture(cost: Armed, bars: Sequence[Shattered]) -> Iterator[Gate]:
    """Yields the requirements on fracture: cost without a broken facet, and cost of a shattering bar."""
    yield Gate(
        f"fracture armed, {cost.tets:,} tets", ">= 5 M updates / CPU-s", f"{cost.armed:.1f} M", cost.armed >= 5.0
    )
    for bar in bars:
        speed = bar.outcome.element_updates_per_second * 1e-6
        what = f"glass bar that shatters, {bar.outcome.elements:,} tets, everything"
        yield Gate(what, ">= 1 M updates / CPU-s", f"{speed:.2f} M", speed >= 1.0)


def of_contact(costs: Sequence[Cost]) -> Iterator[Gate]:
    """Yields the requirements on contact: its cost over the cost of the elements, and the speed of a step with all
    features.
    """
    for cost in costs:
        what = f"{cost.scene.name}, {cost.outcome.elements:,} tets"
        yield Gate(f"{what}: contact over elements", "<= 1", f"{cost.contact:.2f}", cost.contact <= 1.0)
        if "elastic" in cost.scene.name and (cost.outcome.elements or 0) < 1e5:
            speed = cost.outcome.element_updates_per_second * 1e-6
            yield Gate(f"{what}: everything", ">= 5 M updates / CPU-s", f"{speed:.1f} M", speed >= 5.0)
