"""``make bench``: runs all benchmarks one after the other. The program prints tables, and writes the tables to
build/bench/bench.md and the numbers to bench.json.

With ``BENCH=quick`` the benchmarks take about two minutes, by default 15 minutes, with ``BENCH=long`` one hour. The
command ``python -m tests.bench speed taylor`` runs only the named benchmarks.
"""

import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any

from . import (
    accuracy,
    axisymmetric,
    contact_cost,
    cracks,
    fracture_cost,
    gates,
    glass_bar,
    growth,
    guard,
    long_rod,
    machine,
    speed,
    startup,
    taylor_cost,
    telemetry,
)
from .gates import Gate
from .scene import box

OUT = Path(__file__).parents[2] / "build" / "bench"


@dataclass(frozen=True)
class Extent:
    """Amount of work of each benchmark. A benchmark with a count of 0 is left out."""

    sizes: tuple[int, ...]
    metals: tuple[speed.Metal, ...]
    rounds: int
    akantu: bool
    stages: int
    growth: tuple[int, ...]
    startup: int
    plans: list[accuracy.Plan]
    telemetry: int
    quads: tuple[int, ...]
    shots: tuple[long_rod.Variant, ...]


QUICK = Extent(
    sizes=(50_000,), metals=(speed.METALS[0], speed.METALS[3]), rounds=3, akantu=False, stages=0,
    growth=(50_000, 150_000), startup=0, plans=accuracy.grid([1.07], [0.9]), telemetry=0, quads=(3,), shots=(),
)  # fmt: skip
FULL = Extent(
    sizes=(50_000, 144_000, 500_000), metals=speed.METALS, rounds=3, akantu=True, stages=10,
    growth=(50_000, 150_000, 500_000, 2_000_000, 5_000_000), startup=3,
    plans=accuracy.grid([0.54, 0.8, 1.07], [0.9]) + accuracy.grid([1.07], [0.45]), telemetry=40, quads=(3, 4, 6),
    shots=long_rod.MESHES[:2],
)  # fmt: skip
LONG = Extent(
    sizes=FULL.sizes, metals=FULL.metals, rounds=6, akantu=True, stages=10, growth=FULL.growth,
    startup=5,
    plans=[
        *accuracy.grid([0.4], [0.9]), *FULL.plans, *accuracy.grid([0.54, 0.8], [0.45]),
        *accuracy.variants(0.54), *accuracy.variants(0.8),
    ],
    telemetry=120, quads=(3, 4, 6, 8, 12), shots=(*long_rod.MESHES, *long_rod.SPEEDS, *long_rod.OTHERS),
)  # fmt: skip


@dataclass
class Book:
    """Collects the results of the benchmarks, and writes the results after each benchmark."""

    text: list[str] = field(default_factory=list)
    data: dict[str, Any] = field(default_factory=dict)
    shown: list[Gate] = field(default_factory=list)

    def add(self, title: str, text: str, data: object, shown: Iterator[Gate] | None = None) -> None:
        """Adds a section to the report, with its numbers and the requirements on these numbers."""
        self.text.append(f"## {title}\n\n{text.rstrip()}\n")
        print(f"\n{self.text[-1]}", flush=True)
        self.data[title] = data
        self.shown += shown or ()
        self.write()

    def write(self) -> None:
        """Writes the report and the numbers to build/bench."""
        OUT.mkdir(parents=True, exist_ok=True)
        (OUT / "bench.md").write_text("\n".join([*self.text, ""]), encoding="utf-8")
        (OUT / "bench.json").write_text(json.dumps(self.data, indent=1), encoding="utf-8")


def _speed(extent: Extent, book: Book) -> None:
    speeds = list(speed.measure([box(size) for size in extent.sizes], extent.metals, extent.rounds))
    book.add("Speed", speed.tables(speeds), speed.as_data(speeds), gates.of_speed(speeds))


def _akantu(extent: Extent, book: Book) -> None:
    if extent.akantu:
        peers = speed.beside_akantu(box(144_000))
        book.add("Beside Akantu", speed.peer_table(peers), speed.as_data(peers))


def _taylor(extent: Extent, book: Book) -> None:
    if extent.stages:
        stages = taylor_cost.measure("nodal", extent.stages)
        book.add(
            "Johnson-Cook over a Taylor bar",
            taylor_cost.report(stages),
            [asdict(s) for s in stages],
            gates.of_taylor(stages),
        )


def _growth(extent: Extent, book: Book) -> None:
    from . import plot

    sizes = growth.measure(extent.growth, extent.rounds)
    book.add("Cost and memory of a tet", growth.report(sizes), [asdict(s) for s in sizes], gates.of_growth(sizes))
    plot.growth(sizes, OUT / "growth.png")


def _startup(extent: Extent, book: Book) -> None:
    if extent.startup:
        started = startup.measure(extent.startup)
        book.add("Start-up", startup.report(started), asdict(started), gates.of_startup(started))


def _accuracy(extent: Extent, book: Book) -> None:
    from . import plot

    answers = accuracy.measure(extent.plans)
    quads = [axisymmetric.run(bar, cells) for bar in accuracy.BARS for cells in extent.quads]
    text = f"{accuracy.report(answers)}\n\n{axisymmetric.report(quads)}"
    data = {"runs": accuracy.as_data(answers), "quads": [asdict(q) for q in quads]}
    limits = {(q.bar, name): 1e3 * value for q in quads for name, value in (("radius", q.radius), ("extent", q.length))}
    book.add("Speed against error", text, data, gates.of_accuracy(answers))
    plot.speed_and_error(answers, OUT / "speed_error.png", limits)


def _telemetry(extent: Extent, book: Book) -> None:
    handed = telemetry.hand_over()
    costs = telemetry.measure(extent.telemetry) if extent.telemetry else []
    answers = telemetry.digests() if costs else {}
    text = telemetry.message_table(handed) + (f"\n\n{telemetry.report(costs, answers)}" if costs else "")
    data = {"blocks": [asdict(c) for c in costs], "digests": answers, "messages": [asdict(m) for m in handed]}
    book.add("Telemetry", text, data, gates.of_telemetry(costs, answers))


def _contact(extent: Extent, book: Book) -> None:
    costs = list(contact_cost.measure(contact_cost.SCENES[:1] if extent is QUICK else contact_cost.SCENES))
    data = {c.scene.name: c.outcome.phases for c in costs}
    book.add("Contact", contact_cost.report(costs), data, gates.of_contact(costs))


def _contact_domain(extent: Extent, book: Book) -> None:
    if extent is not QUICK:
        from . import plot

        found = {ranks: contact_cost.domains(ranks, steps) for ranks, steps in contact_cost.STEPS.items()}
        texts = []
        for ranks, steps in contact_cost.STEPS.items():
            plot.domains(found[ranks], steps, OUT / f"contact_domain_{ranks}.png")
            texts.append(f"{ranks} ranks, {steps} steps\n\n{contact_cost.domain_report(found[ranks], steps)}")
        book.add("Contact domain", "\n\n".join(texts), found)


def _fracture(extent: Extent, book: Book) -> None:
    cost = fracture_cost.armed(4 if extent is QUICK else 20)
    bars = list(fracture_cost.shatter(fracture_cost.SIZES[: 1 if extent is QUICK else len(fracture_cost.SIZES)]))
    data = {"armed": asdict(cost), "bars": {b.size: b.outcome.element_updates_per_second for b in bars}}
    book.add("Fracture", fracture_cost.report(cost, bars), data, gates.of_fracture(cost, bars))


def _cracks(extent: Extent, book: Book) -> None:
    if extent is not QUICK:
        runs = list(
            cracks.measure(
                [*cracks.PLATES, *cracks.SIBLINGS, *cracks.STEPPED, *chain(*cracks.ROWS), *cracks.STRIPS, *cracks.BARS]
            )
        )
        from . import plot

        book.add("Cracks", cracks.report(runs), cracks.as_data(runs))
        plot.paths([r for r in runs if r.plan in cracks.SHOWN], OUT / "branching.png")


def _glass_bar(extent: Extent, book: Book) -> None:
    if extent is not QUICK:
        bars = list(glass_bar.measure(glass_bar.SIZES if extent is LONG else glass_bar.SIZES[:2]))
        book.add("Glass bar", glass_bar.report(bars), glass_bar.as_data(bars))


def _long_rod(extent: Extent, book: Book) -> None:
    shots = []
    for shot in long_rod.measure(extent.shots):
        shots.append(shot)
        print(long_rod.report([shot]).splitlines()[-1], flush=True)
    if shots:
        times = [f"{s.variant.name}\n\n{long_rod.course(s.course)}" for s in shots if s.variant.name == "1 mm"]
        book.add(
            "Long rod", "\n\n".join([long_rod.report(shots), *times]), long_rod.as_data(shots), gates.of_long_rod(shots)
        )


def _guard(extent: Extent, book: Book) -> None:
    try:
        place = guard.sources(guard.BASE)
    except guard.NoCommitError as error:
        book.add("Guard", f"not measured: {error}", None)
        return
    found = list(guard.measure(guard.QUICK if extent is QUICK else guard.SCENES, place))
    book.add("Guard", guard.report(found, guard.BASE), {each.scene.name: each.ratio() for each in found})


PARTS: dict[str, Callable[[Extent, Book], None]] = {
    "speed": _speed, "akantu": _akantu, "taylor": _taylor, "growth": _growth, "startup": _startup,
    "accuracy": _accuracy, "telemetry": _telemetry, "contact": _contact, "contact_domain": _contact_domain,
    "fracture": _fracture, "cracks": _cracks, "glass_bar": _glass_bar, "long_rod": _long_rod,
    "guard": _guard,
}  # fmt: skip


def main(arguments: Sequence[str]) -> int:
    """Runs the named benchmarks, or all benchmarks."""
    extents = {"quick": QUICK, "full": FULL, "long": LONG}
    wanted = os.environ.get("BENCH") or "full"
    unknown = [name for name in arguments if name not in PARTS]
    if wanted not in extents or unknown:
        print(f"BENCH={wanted} {' '.join(unknown)}: BENCH is one of {', '.join(extents)}; parts are {', '.join(PARTS)}")
        return 2
    book, began = Book(), time.monotonic()
    facts = machine.describe()
    book.add("Machine", "\n".join(f"- {name}: {value}" for name, value in facts.items()), facts)
    for name in arguments or PARTS:
        begin = time.monotonic()
        PARTS[name](extents[wanted], book)
        print(f"({name}: {time.monotonic() - begin:.0f} s, load {machine.load()})", flush=True)
    if book.shown:
        book.add("Must show", gates.report(book.shown), [asdict(gate) for gate in book.shown])
    print(f"{(time.monotonic() - began) / 60:.1f} minutes; tables, numbers and picture in {OUT}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
