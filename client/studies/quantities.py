"""Numbers of a finished run that a study compares: references, probes, energies, counts."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from conoid.cases.messages import Energy
from conoid.cases.model.schema import Case
from conoid.cases.outcome import Outcome
from conoid.cases.output import history

from ..columns import Columns

_COUNTS = ("broken", "fragments", "eroded")
_NO_STORE = ("initial", "external", "stepping", "averaging", "residual")
"""Terms of the energy balance that are not energies of the final state."""
_FLOOR, _SHARE = 1e-6, 0.01
"""Negligible differences: a millionth of the value, and a hundredth of the tolerance of a reference (chosen values)."""


@dataclass(frozen=True)
class Number:
    """A quantity of a run that a study compares."""

    name: str
    value: float
    unit: str = ""
    expected: float | None = None
    tolerance: float = 0.0
    source: str = ""

    @property
    def floor(self) -> float:
        """Smallest difference that is significant."""
        return max(_FLOOR * abs(self.value), _SHARE * self.tolerance)

    @property
    def of_nothing(self) -> bool:
        """True if the expected value is about 0; then the quantity has no relative error."""
        return self.expected is not None and abs(self.expected) <= self.tolerance

    @property
    def scale(self) -> float:
        """Divisor of errors: the expected value, or the measured value if zero is expected."""
        return max(abs(self.expected if self.expected is not None else self.value), self.tolerance)


def of_run(case: Case, outcome: Outcome, columns: Columns) -> list[Number]:
    """Returns the quantities of a run: references in their order, then probes, then final energies relative to the
    initial energy, then counts.
    """
    found = [*_references(outcome), *_probes(case, columns), *_energies(outcome), *_counts(case, outcome)]
    return [number for number in found if "worst_residual" not in number.name]


def names(case: Case) -> list[str]:
    """Returns the names of all quantities that ``of_run`` can return."""
    of_probes = (f"{what} of {probe.name}" for probe in case.probes for what in ("mean", "peak", "end"))
    energies = (f"{name} energy, share" for name in history.LEDGER if name not in _NO_STORE)
    counts = (f"{name}, number" for name in _COUNTS if case.fractures or case.erodes)
    found = [*_numbered(each.title for each in case.reference), *of_probes, *energies, *counts]
    return [name for name in found if "worst_residual" not in name]


def _numbered(titles: Iterable[str]) -> Iterator[str]:
    """Yields the names; names that occur more than once get a number."""
    seen: dict[str, int] = {}
    for title in titles:
        seen[title] = seen.get(title, 0) + 1
        yield title if seen[title] == 1 else f"{title} ({seen[title]})"


def _references(outcome: Outcome) -> Iterator[Number]:
    titles = _numbered(check.name for check in outcome.reference)
    for name, check in zip(titles, outcome.reference, strict=True):
        yield Number(name, check.value, check.unit, check.expected, check.tolerance, check.source)


def _probes(case: Case, columns: Columns) -> Iterator[Number]:
    """Yields three quantities for each probe: the mean over time, the value with the largest magnitude, and the last
    value.
    """
    for name in (probe.name for probe in case.probes):
        values, unit = columns.numbers(name), columns.units[name]
        finite = [value for value in values if value == value]
        if finite:
            yield Number(f"mean of {name}", sum(finite) / len(finite), unit)
            yield Number(f"peak of {name}", max(finite, key=abs), unit)
            yield Number(f"end of {name}", finite[-1], unit)


def _energies(outcome: Outcome) -> Iterator[Number]:
    energy = outcome.energy
    if energy is None:
        return
    came = max(energy.initial + max(energy.external, 0.0), 1e-300)
    for name in Energy.__struct_fields__:
        if name in history.LEDGER and name not in _NO_STORE:
            value = float(getattr(energy, name))
            if abs(value) > 1e-4 * came:
                yield Number(f"{name} energy, share", value / came)


def _counts(case: Case, outcome: Outcome) -> Iterator[Number]:
    if case.fractures or case.erodes:
        for name in _COUNTS:
            if getattr(outcome, name):
                yield Number(f"{name}, number", float(getattr(outcome, name)))
