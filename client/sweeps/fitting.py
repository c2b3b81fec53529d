"""Choice of the curve for an adaptive sweep, or the reason why there is no curve."""

from collections.abc import Sequence
from importlib.util import find_spec

from . import ballistic
from .bracket import Bracket, Sample
from .goal import Goal, Span
from .reporting import in_si


def fitted(goal: Goal, span: Span, samples: Sequence[Sample], made: Bracket) -> ballistic.Fit | None:
    """Fits the law of residual velocity over impact velocity, or a line near the point at which the result crosses
    the threshold.
    """
    if _stopped(goal, span, samples, made):
        return ballistic.residual_velocity(samples, made, goal.threshold, in_si(span)[0])
    return ballistic.line(samples, made) if _through(samples) and made.changes == 1 else None


def unfitted(goal: Goal, span: Span, samples: Sequence[Sample], made: Bracket) -> str:
    """Returns the reason why ``fitted`` has returned None."""
    if find_spec("scipy") is None:
        return "the fit needs scipy (pip install 'conoid[fit]')"
    if made.changes != 1:
        return "the result crosses the threshold several times"
    if not _stopped(goal, span, samples, made):
        return "no line fits the results near the threshold"
    if ballistic.beyond(samples, made, goal.threshold) < ballistic.FEWEST:
        return f"fewer than {ballistic.FEWEST} results above the limit"
    return "the results above the limit do not follow the law of Lambert and Jonas"


def _stopped(goal: Goal, span: Span, samples: Sequence[Sample], made: Bracket) -> bool:
    """Returns True if the result is a residual velocity over an impact velocity."""
    speeds = span.unit.endswith("/s") and goal.unit == "m/s"
    return speeds and ballistic.stops(samples, made, goal.threshold)


def _through(samples: Sequence[Sample]) -> bool:
    """Returns True if the results lie on both sides of the threshold."""
    known = [sample.f for sample in samples if sample.f is not None]
    return min(known) < 0.0 < max(known)
