"""Replay of the measured loads of a run with another policy of load balance, without the solver. The replay shows what
new decompositions would have cost and saved.

A run reports the cost of each group of tets at intervals (worker/migration/groups.py). A decomposition assigns
groups to ranks in the same way as in the run: the first decomposition by numbers of tets, later decompositions by
measured loads. See docs/performance/balance.md.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from conoid.cases.estimates.balancing import WORK, Guard, Trigger, lost
from conoid.cases.figures import number
from conoid.cases.messages import AnyMessage, Balance, Groups, Load
from conoid.cases.model.schema import Balance as Spec

from ..errors import ClientError, UsageError

Point = tuple[float, float, float]
Shares = list[tuple[int, float]]
"""Groups of a rank, each with the fraction of the group that the rank has."""


@dataclass
class Account:
    """Cost and saving of a policy. Times are in s."""

    policy: str
    ranks: int
    cuts: list[int] = field(default_factory=list)
    """Steps before which the mesh was decomposed."""
    lost: float = 0.0
    """Time lost by imbalance, s: work of the most loaded rank minus the mean work."""
    cost: float = 0.0
    """Time of all decompositions, s."""
    work: float = 0.0
    """Mean work of a rank, s."""
    imbalance: float = 1.0
    """Largest load of a rank relative to the mean, over all steps."""
    total: float = 0.0
    """Time lost by imbalance plus the time of the decompositions, s."""

    def book(self, loads: Sequence[float], steps: int) -> None:
        """Adds the loads of all ranks, s per step, for a number of steps."""
        self.lost += lost(loads) * steps
        self.work += sum(loads) / len(loads) * steps
        self._close()

    def cut(self, step: int, cost: float) -> None:
        """Adds a decomposition before a step with its cost, s."""
        self.cuts.append(step)
        self.cost += cost
        self._close()

    def _close(self) -> None:
        self.total = self.lost + self.cost
        self.imbalance = 1.0 + self.lost / self.work if self.work > 0.0 else 1.0


@dataclass
class Record:
    """Measured loads of the groups of tets of a run."""

    centres: list[Point]
    """Centres of the groups of tets at the start, m."""
    tets: list[int]
    moments: list[Groups]
    """Messages with the loads of the groups; the first message has no loads yet."""
    cost: float
    """Mean cost of a decomposition in the run, s, or an assumed cost if the run had no decomposition."""
    happened: Account
    """Cost and saving of the policy that the run itself used."""

    @property
    def heaviest(self) -> float:
        """Largest fraction of the total work that one group has at any time."""
        return max((max(m.load) / sum(m.load) for m in self.moments if any(m.load)), default=0.0)


def read(messages: Iterable[AnyMessage], policy: str = "") -> Record:
    """Reads the loads of a run from its messages. Messages of steps beyond the checkpoint from which the run
    continued are dropped. Raises ClientError if the messages have no loads.
    """
    moments: list[Groups] = []
    first, costs, expected = None, [], 0.0
    happened = Account(policy, 1)
    for message in messages:
        if isinstance(message, Groups):
            while moments and moments[-1].step > message.step:
                moments.pop()
            if not moments or moments[-1].step < message.step:
                moments.append(message)
            first, expected = (message, message.cost) if message.centres else (first, expected)
        elif isinstance(message, Load):
            shared = [seconds for name, seconds in message.phases.items() if name in WORK]
            work = [sum(seconds) for seconds in zip(*shared, strict=True)]
            if work:
                happened.ranks = len(work)
                happened.book(work, 1)
        elif isinstance(message, Balance):
            costs.append(message.cost)
            happened.cut(message.step, message.cost)
    if first is None or len(moments) < 2:
        raise ClientError("the journal of the run has no loads of groups of tets")
    cost = sum(costs) / len(costs) if costs else expected
    return Record(first.centres, first.tets, moments, cost, happened)


def replay(record: Record, spec: Spec, ranks: int, cost: float, scale: Point = (1.0, 1.0, 1.0)) -> Account:
    """Returns the result of the policy ``spec`` on ``ranks`` ranks; each decomposition costs ``cost`` s. ``scale``:
    factors of positions before each decomposition. The number of ranks must not exceed the number of groups.
    """
    if not 1 <= ranks <= len(record.centres):
        raise UsageError(f"ranks = {ranks}: allowed: 1 to {len(record.centres)}, the number of groups")
    places = [(x * scale[0], y * scale[1], z * scale[2]) for x, y, z in record.centres]
    account, trigger, first = Account(named(spec), ranks), Trigger(spec, cost), record.moments[0]
    held = divide(places, record.tets, ranks)
    guards = _guards(spec, first, held)
    before, end = first.step, record.moments[-1].step
    trigger.step = before
    for moment in record.moments[1:]:
        for step in _looks(spec, before, moment.step):
            loads = [1e-9 * (moment.rank + load) for load in _sums(held, moment.load)]
            account.book(loads, step - before)
            trigger.look(loads, step - before)
            grown = [g.grown(round(n)) for g, n in zip(guards, _sums(held, moment.outside), strict=True)]
            if ranks > 1 and step < end and trigger.cause(step, any(grown)) is not None:
                account.cut(step, cost)
                trigger.settle(step, cost)
                held = divide(places, _weights(spec, record, moment), ranks)
                guards = _guards(spec, moment, held)
            before = step
    return account


def compare(record: Record, spec: Spec, ranks: int, cost: float, scale: Point) -> list[Account]:
    """Returns the results of the policy ``spec`` and of the other policies; all use the parameters ``alpha`` and
    ``every`` of ``spec``.
    """
    policies = [spec.policy, *(p for p in ("measured", "outside", "every", "never") if p != spec.policy)]
    specs = [spec.model_copy(update={"policy": policy}) for policy in policies]
    return [replay(record, each, ranks, cost, scale) for each in specs]


def chosen(spec: Spec, words: str, alpha: float | None = None) -> Spec:
    """Returns the ``spec`` of a case with another policy in the notation of a user, such as ``every:500``. Raises
    UsageError.
    """
    policy, colon, every = words.partition(":")
    options = {"policy": policy} | ({"every": every} if every else {}) | ({"alpha": alpha} if alpha is not None else {})
    try:
        if colon and (policy != "every" or not every):
            raise ValueError
        return Spec.model_validate(spec.model_dump() | options)
    except ValueError:
        raise UsageError(
            f"policy = {words!r}, alpha = {number(spec.alpha if alpha is None else alpha)}: "
            "allowed: measured, outside, every, every:N, never; alpha greater than 1"
        ) from None


def named(spec: Spec) -> str:
    """Returns the name of the policy with its parameter."""
    return spec.policy + {"outside": f" {number(spec.alpha)}", "every": f":{spec.every}"}.get(spec.policy, "")


def _looks(spec: Spec, before: int, now: int) -> Iterator[int]:
    """Yields the time steps before which the policy decides about a decomposition: those after ``before`` and up to
    ``now``. The last yielded step is ``now``.
    """
    if spec.policy == "every":
        yield from range((before // spec.every + 1) * spec.every, now, spec.every)
    yield now


def _weights(spec: Spec, record: Record, moment: Groups) -> Sequence[float]:
    """Returns the quantity of each group that the decomposition balances."""
    weights = {"measured": moment.load, "outside": moment.outside, "tets": record.tets}[spec.weights]
    return weights if any(weights) else record.tets


def _guards(spec: Spec, moment: Groups, held: list[Shares]) -> list[Guard]:
    return [Guard(spec.alpha, round(n)) for n in _sums(held, moment.outside)]


def _sums(held: list[Shares], values: Sequence[float]) -> list[float]:
    """Returns (ranks,) the sums of ``values`` (groups,) over the groups of each rank."""
    return [sum(share * values[group] for group, share in shares) for shares in held]


def divide(places: Sequence[Point], weights: Sequence[float], ranks: int) -> list[Shares]:
    """Returns the groups of each rank. The box of all groups is cut across its longest axis so that both parts have
    equal sums of ``weights`` (groups,) for each of their ranks; each part is cut again in the same way. A group at a
    cut is divided between two ranks. If the number of ranks of a part is odd, one side of the cut gets one rank more
    than the other.
    """
    return _halved([(group, 1.0) for group in range(len(places))], places, weights, ranks)


def _halved(members: Shares, places: Sequence[Point], weights: Sequence[float], ranks: int) -> list[Shares]:
    if ranks == 1 or not members:
        return [members, *([] for _ in range(ranks - 1))]
    along = [[places[group][axis] for group, _ in members] for axis in range(3)]
    axis = max(range(3), key=lambda a: max(along[a]) - min(along[a]))
    ordered = sorted(members, key=lambda member: (places[member[0]][axis], member[0]))
    left = ranks // 2
    wanted = sum(weights[group] * share for group, share in ordered) * left / ranks
    low: Shares = []
    high: Shares = []
    for group, share in ordered:
        weight = weights[group] * share
        part = min(wanted / weight, 1.0) if weight > 0.0 else float(wanted > 0.0)
        wanted = max(wanted - weight, 0.0)
        low += [(group, share * part)] if part > 0.0 else []
        high += [(group, share * (1.0 - part))] if part < 1.0 else []
    return [*_halved(low, places, weights, left), *_halved(high, places, weights, ranks - left)]
