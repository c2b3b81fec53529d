"""Reports of an adaptive sweep to the server, so that the page can show them: the points so far, the bracket and the
result.
"""

import math
import time
from collections.abc import Mapping, Sequence
from typing import Protocol

import msgspec

from conoid.cases.output.search import MOST_RUNS, Curve, Search, SearchPoint
from conoid.cases.reference.key_units import unit_of_key
from conoid.cases.units import parse_quantity

from ..errors import ClientError
from ..local.safe_paths import quoted
from .adaptive_result import Tried
from .ballistic import Fit, course
from .bracket import Bracket
from .goal import Goal, Span

_PROBLEM, _WHY = 200, 1000
"""Largest numbers of characters of the texts ``problem`` and ``why`` in a report (cases/output/search.py)."""


class Reported(msgspec.Struct, kw_only=True, frozen=True):
    """Answer of the server to a report: the id of the sweep, and ``stop``, which is True if the sweep was cancelled
    on the server.
    """

    id: str
    stop: bool = False


class Put(Protocol):
    """Type of the method ``Http.put``."""

    def __call__(self, kind: type[Reported], path: str, body: bytes, headers: Mapping[str, str]) -> Reported:
        """Sends a PUT request and returns the answer."""


class Reporter:
    """Sender of the reports of an adaptive sweep to a server. A report contains all points, so that the next report
    replaces a report that was not sent. The runs and the file of the sweep do not depend on reports.
    """

    def __init__(self, put: Put, name: str, case: str, goal: Goal, spans: Sequence[Span], tolerance: float) -> None:
        """Stores the data of all reports; nothing is sent yet. ``name`` identifies the sweep and is equal in all
        commands of a sweep; ``case``: name of the case.
        """
        self._put, self._path, self._goal = put, f"/v1/sweeps/adaptive/{quoted(name)}", goal
        span = spans[0]
        self._scale, unit = in_si(span)
        low, high = sorted(self._x(end) for end in (span.low, span.high))
        self._plain = Search(
            name=case[:_PROBLEM], began=time.time(), result=goal.result, threshold=goal.threshold,
            result_unit=goal.unit, key=span.key, more=[each.key for each in spans[1:]], unit=unit, low=low, high=high,
            tolerance=self._scale * tolerance,
        )  # fmt: skip
        self.id = ""
        """Id of the sweep on the server; empty if the server does not store adaptive sweeps."""
        self.stop = False
        """True if the sweep was cancelled on the server."""

    def tell(
        self, tried: Sequence[Tried], made: Bracket | None, fit: Fit | None = None, *, over: bool = False,
        why: str = "",
    ) -> None:  # fmt: skip
        """Sends a report with all points, including points whose runs have not ended, the bracket, and the fitted
        curve if there is one.
        """
        points = sorted((self._point(each) for each in tried), key=lambda point: point.x)[:MOST_RUNS]
        search = msgspec.structs.replace(
            self._plain, points=points, over=over, why=why[:_WHY],
            bracket=self._pair(None if made is None else (made.low.x, made.high.x)),
            mixed=self._pair(None if made is None else made.mixed),
            curve=None if fit is None or made is None else self._curve(fit, made, tried),
        )  # fmt: skip
        try:
            answer = self._put(Reported, self._path, msgspec.json.encode(search), {"Content-Type": "application/json"})
        except ClientError:  # The server cannot be reached, or is too old for reports.
            return
        self.id, self.stop = answer.id, answer.stop

    def _x(self, x: float) -> float:
        return self._scale * x

    def _pair(self, ends: tuple[float, float] | None) -> tuple[float, float] | None:
        return ends and (self._x(min(ends)), self._x(max(ends)))

    def _point(self, each: Tried) -> SearchPoint:
        return SearchPoint(
            x=self._x(each.x), changed={key[:_PROBLEM]: value for key, value in each.values.items()}, run=each.run,
            value=each.value, problem=each.problem[:_PROBLEM],
        )  # fmt: skip

    def _curve(self, fit: Fit, made: Bracket, tried: Sequence[Tried]) -> Curve:
        """Returns the fitted curve with the signs of key and result, because a law of velocities is fitted to
        magnitudes.
        """
        values = [each for each in tried if each.value is not None]
        law = fit.law != "line"
        way = math.copysign(1.0, made.low.x + made.high.x) if law else 1.0
        up = math.copysign(1.0, sum(each.value or 0.0 for each in values)) if law else 1.0
        shift = 0.0 if law else self._goal.threshold
        along = sorted(abs(each.x) if law else each.x for each in values)
        drawn = course(fit, along[0], along[-1])
        return Curve(
            law=fit.law, limit=self._x(way * fit.limit), error=fit.error and self._x(fit.error),
            factor=fit.factor / (1.0 if law else self._scale), exponent=fit.exponent,
            course=[(self._x(way * x), shift + up * y, error) for x, y, error in drawn],
        )  # fmt: skip


def in_si(span: Span) -> tuple[float, str]:
    """Returns the value of the span's unit in SI, and the SI unit of the key."""
    unit = unit_of_key(span.key)
    if not span.unit or not unit:
        return 1.0, span.unit or unit
    return float(parse_quantity(f"1 {span.unit}", unit)), unit
