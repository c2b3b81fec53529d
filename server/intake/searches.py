"""Adaptive sweeps (searches): the client chooses the next point from the results so far, submits it as a run, and sends
a report, which the server stores.
"""

import re
import threading
import time
from collections.abc import Sequence

import msgspec

from conoid.cases.figures import size
from conoid.cases.output.search import Search

from ..database.store import Store
from ..errors import ServiceError, not_found
from ..runs import folder
from .plans import Plan, Plans

_NAME = re.compile(r"[0-9a-f]{16,64}")
"""Pattern of the name of an adaptive sweep. The client computes the name from its request; the same command therefore
has the same name again."""
_MOST_BYTES = 256 << 10
"""Largest size in bytes of a report (chosen value): enough for the largest number of points with three keys each."""
_MOST = 100
"""Largest number of adaptive sweeps that are kept of a user: 25 MB of memory (chosen value). A further adaptive sweep
replaces the oldest one, whose runs stay."""


class Searches:
    """Adaptive sweeps of all users. All methods of this class may be called from any thread."""

    def __init__(self, plans: Plans, store: Store) -> None:
        """Creates the object. ``plans``: the stored sweeps of the server."""
        self._plans, self._store, self._lock = plans, store, threading.Lock()

    def report(self, owner: str, name: str, body: bytes) -> Plan:
        """Stores a report of an adaptive sweep. The first report with a new name creates the sweep. Cancels an adaptive
        sweep: its client command may submit no more runs.
        """
        if not _NAME.fullmatch(name):
            raise not_found(f"adaptive sweep {name[:40]!r}")
        search = _read(body)
        known = self._store.some([point.run for point in search.points if point.run])
        own = {run_id for run_id, run in known.items() if run.owner == owner}
        kept = [point if point.run in own else msgspec.structs.replace(point, run="") for point in search.points]
        with self._lock:
            earlier = [plan for plan in self._plans.of(owner) if plan.search is not None]
            there = next((plan for plan in earlier if plan.key == name), None)
            plan = _reported(there or _begun(owner, name, search), msgspec.structs.replace(search, points=kept))
            self._plans.write(plan)
            self._make_room([] if there else earlier)
        return plan

    def cancel(self, plan: Plan) -> None:
        """Cancels an adaptive sweep: the client command that selects the points must submit no more runs."""
        with self._lock:
            plan = self._plans.get(plan.id) or plan
            if plan.search is not None and not plan.search.over:
                self._plans.write(msgspec.structs.replace(plan, cancelled=plan.search.began))

    def _make_room(self, earlier: Sequence[Plan]) -> None:
        for plan in earlier[_MOST - 1 :]:
            self._plans.remove(plan)


def _read(body: bytes) -> Search:
    """Decodes a report of an adaptive sweep. Raises ServiceError with status 413 or 422."""
    if len(body) > _MOST_BYTES:
        raise ServiceError(413, "too_large", f"the report has {size(len(body))}; allowed: {size(_MOST_BYTES)}")
    try:
        return msgspec.json.decode(body, type=Search)
    except (msgspec.MsgspecError, RecursionError) as error:
        raise ServiceError(422, "invalid_report", str(error)[:300]) from None


def _begun(owner: str, name: str, search: Search) -> Plan:
    sweep_id, now = folder.new_id()
    return Plan(id=sweep_id, owner=owner, name=search.name, submitted=now, key=name, digest="", at_once=None, points=[])


def _reported(plan: Plan, search: Search) -> Plan:
    """Returns the stored sweep with the new report. The lists ``points`` and ``runs`` of the sweep contain only points
    whose run exists.
    """
    there = [point for point in search.points if point.run]
    return msgspec.structs.replace(
        plan, search=search, reported=time.time(), points=[dict(point.changed) for point in there],
        runs=[point.run for point in there],
    )  # fmt: skip
