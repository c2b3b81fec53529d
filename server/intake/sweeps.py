"""Sweeps: one case at several points; each point is a run with changed values. A sweep is one plain file,
``<runs>/sweeps/<id>.json``.

The file of a sweep is written before the first run is made, and the idempotency key of each run consists of the id of
the sweep and the number of the point. Therefore a client can repeat an interrupted request: the server completes the
sweep and makes no run twice. If a server was killed while it accepted a sweep, the next server completes the sweep; it
removes a sweep whose request had no idempotency key. The runs of a sweep start only after all of them are accepted.
"""

import hashlib
import logging
import re
import threading
import time
from collections.abc import Iterable, Mapping, Sequence

import msgspec

from conoid.cases.figures import size
from conoid.cases.load import CaseError

from ..errors import ServiceError
from ..queue.scheduling import Need
from ..runs import folder
from ..settings import Settings
from .plans import Plan, Plans
from .reading import Reading
from .submission import Desk, Wishes
from .sweep_request import Wish, at_point, changed, wish_of

_log = logging.getLogger("conoid.server")
_AGAIN = 2.0
"""Time in s after which the server tries again to complete a sweep (chosen value)."""
_MOST_BYTES = 16 << 20
"""Largest size in bytes of the cases of all points together; reading them takes one second (reason of the chosen
value)."""
_JSON = "application/json"
_HASHES = re.compile(r"[0-9a-f]{64}")


class Sweeps:
    """The sweeps of a server. All methods of this class may be called from any thread."""

    def __init__(self, settings: Settings, desk: Desk) -> None:
        """Reads the stored sweeps."""
        self.plans, self._desk = Plans(settings), desk
        self._locks: dict[str, threading.Lock] = {}
        """Locks, one for each owner, so that a large sweep of one user does not delay other users."""
        self._filling: set[str] = set()
        self._cancelled: set[str] = set()
        self._left = [plan for plan in self.plans if not plan.whole]
        self._filling |= {plan.id for plan in self._left}

    def complete(self) -> None:
        """Completes the sweeps that an earlier server has accepted only in part, in a thread. The runs of such a sweep
        wait until it is complete.
        """
        for plan in self._left:
            runs = plan.earlier or self._desk.runs_of(plan.owner, plan.keys)
            self.plans.put(msgspec.structs.replace(plan, runs=runs))
        self._complete_later(self._left)

    def _complete_later(self, plans: Sequence[Plan]) -> None:
        if plans:
            threading.Thread(target=self._complete_all, args=(plans,), name="sweeps", daemon=True).start()

    def _complete_all(self, plans: Sequence[Plan]) -> None:
        for plan in plans:
            while not self._completed(plan):
                time.sleep(_AGAIN)

    def _completed(self, plan: Plan) -> bool:
        """Completes a sweep; returns False if the server must try again later. A sweep that cannot be completed is
        removed. A sweep without idempotency key is also removed: its client got no answer and will send a new request.
        """
        with self._locks.setdefault(plan.owner, threading.Lock()):
            there = self.plans.get(plan.id)
            if there is None or there.whole:
                return True
            try:
                if plan.case is None or plan.key is None:
                    raise ServiceError(409, "no_key", "the request was interrupted and has no Idempotency-Key")
                self._fill(plan, self._cases(plan))
            except ServiceError as error:
                if error.body["retryable"] and plan.id not in self._cancelled:
                    return False
                _log.error("sweep %s cannot be completed and is cancelled: %s", plan.id, error)
                self._take_back(plan)
                return True
            except Exception:
                _log.exception("sweep %s is completed later", plan.id)
                return False
            self._filling.discard(plan.id)
            return True

    def cancel(self, plan: Plan) -> list[str]:
        """Cancels the rest of the submission of a sweep, and returns the runs that exist. After the call no further run
        of the sweep starts.
        """
        if not plan.whole:
            self._cancelled.add(plan.id)
        return (self.plans.get(plan.id) or plan).runs

    def get(self, sweep_id: str, owner: str) -> Plan | None:
        """Returns a sweep of the owner; None if the owner has no such sweep."""
        plan = self.plans.get(sweep_id)
        return plan if plan is not None and plan.owner == owner else None

    def submit(self, owner: str, body: bytes, key: str | None) -> Plan:
        """Accepts either all runs of a sweep or none of them. A request with the same idempotency key and body returns
        the same sweep. Raises ServiceError if the sweep is refused.
        """
        digest = hashlib.sha256(body).hexdigest()
        with self._locks.setdefault(owner, threading.Lock()):
            plan = self._earlier(owner, key, digest)
            if plan is not None and plan.whole:
                return plan
            fresh = plan or self._new(owner, wish_of(body), key, digest)
            return self._accepted(fresh)

    def again(self, plan: Plan, body: bytes, failed: Mapping[int, str]) -> Plan:
        """Repeats points of a sweep with new runs. ``failed``: the points to repeat, with their present runs; ``body``:
        the request of the sweep. Raises ServiceError, and leaves the sweep unchanged, if the repetition is refused.
        """
        with self._locks.setdefault(plan.owner, threading.Lock()):
            plan = self.plans.get(plan.id) or plan
            if hashlib.sha256(body).hexdigest() != plan.digest:
                raise ServiceError(422, "key_reused", f"the case or the points differ from those of sweep {plan.id}")
            repeated = [n for n, run in failed.items() if plan.whole and plan.runs[n] == run]
            if not repeated:
                return plan
            tries = plan.tries or [0] * len(plan.points)
            fresh = msgspec.structs.replace(
                plan, case=wish_of(body).case, repeated=repeated, earlier=plan.runs,
                tries=[n + (k in repeated) for k, n in enumerate(tries)],
            )  # fmt: skip
            return self._accepted(fresh)

    def _accepted(self, plan: Plan) -> Plan:
        """Accepts the missing runs of a sweep, all or none, and returns the sweep with these runs. Raises ServiceError
        if the runs are refused.
        """
        cases = self._cases(plan)
        self._desk.check_room(plan.owner, [plan.keys[n] for n in plan.wanted])
        self.plans.write(plan)
        self._filling.add(plan.id)
        try:
            filled = self._fill(plan, cases)
        except ServiceError:
            self._take_back(plan)
            raise
        except Exception:
            self._complete_later([plan])
            raise
        self._filling.discard(plan.id)
        self._cancelled.discard(
            plan.id
        )  # all runs of the sweep exist from here on, so that a later cancel cancels the runs
        return filled

    def held(self, need: Need, active: Iterable[Need]) -> str:
        """Returns why a run of a sweep waits: the sweep is not complete, or its largest number of concurrent runs is
        reached. ``active``: the runs that have cores. A label of the run contains the id of its sweep.
        """
        plan = self.get(need.sweep, need.owner)
        if plan is None:
            return ""
        if plan.id in self._filling:
            return "the other runs of the sweep are not accepted yet"
        if plan.at_once is None:
            return ""
        own = sum(one.sweep == need.sweep and one.owner == need.owner for one in active)
        return f"{own} runs of the same sweep are running, the largest number at a time" if own >= plan.at_once else ""

    def needed(self) -> set[str]:
        """Returns the hashes of files that must not be removed because runs of unfinished submissions may name them."""
        plans = [plan for plan in self.plans if not plan.whole]
        return {
            word for plan in plans for word in _HASHES.findall(msgspec.json.encode([plan.case, plan.points]).decode())
        }

    def _earlier(self, owner: str, key: str | None, digest: str) -> Plan | None:
        found = [p for p in self.plans.of(owner) if key is not None and p.key == key and p.search is None]
        if found and found[0].digest != digest:
            detail = f"Idempotency-Key {key!r} was used for another sweep: {found[0].id}"
            raise ServiceError(422, "key_reused", detail, pointer="Idempotency-Key", hint="use a new key")
        return found[0] if found else None

    def _cases(self, plan: Plan) -> dict[int, tuple[bytes, Reading]]:
        """Returns the case of each point that needs a run. Raises ServiceError with the problems of the cases."""
        made = {n: changed(plan.case or {}, plan.points[n], n) for n in plan.wanted}
        if sum(map(len, made.values())) > _MOST_BYTES:
            raise ServiceError(413, "too_large", f"the cases have more than {size(_MOST_BYTES)} together")
        cases, source, surveys = {}, self._desk.source(plan.owner), dict[bytes, bytes]()
        for n, text in made.items():
            try:
                cases[n] = text, self._desk.read(text, _JSON, source, surveys, swept=True)
            except CaseError as error:
                raise at_point(n, error) from None
        return cases

    def _new(self, owner: str, wish: Wish, key: str | None, digest: str) -> Plan:
        sweep_id, now = folder.new_id()
        return Plan(
            id=sweep_id, owner=owner, name=str(wish.case.get("name", "")), submitted=now, key=key, digest=digest,
            at_once=wish.at_once, points=wish.points, case=wish.case,
        )  # fmt: skip

    def _fill(self, plan: Plan, cases: Mapping[int, tuple[bytes, Reading]]) -> Plan:
        runs, keys = list(plan.earlier), plan.keys
        for n, (body, reading) in cases.items():
            if plan.id in self._cancelled:
                raise ServiceError(409, "cancelled", f"sweep {plan.id} was cancelled while its runs were submitted")
            wishes = Wishes({"sweep": plan.id, "point": str(n)})
            receipt = self._desk.submit(plan.owner, body, _JSON, keys[n], wishes, reading)
            runs[n : n + 1] = [receipt["id"]]
            plan = msgspec.structs.replace(plan, runs=list(runs))
            self.plans.put(plan)
        plan = msgspec.structs.replace(plan, case=None, repeated=[], earlier=[])
        self.plans.write(plan)
        return plan

    def _take_back(self, plan: Plan) -> None:
        """Cancels the runs of a refused sweep; none of them has started yet. If points were repeated, their earlier
        runs stay.
        """
        for run_id in self._desk.runs_of(plan.owner, [plan.keys[n] for n in plan.wanted]):
            self._desk.take_back(run_id)
        self._cancelled.discard(plan.id)
        self._filling.discard(plan.id)
        if plan.repeated:
            self.plans.write(msgspec.structs.replace(plan, case=None, runs=plan.earlier, repeated=[], earlier=[]))
            return
        self.plans.remove(plan)
