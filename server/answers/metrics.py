"""What Prometheus reads: runs, slots, streams, and the time that answers take."""

import time
from collections import Counter as Counts
from collections.abc import Callable, Iterable

from prometheus_client import CollectorRegistry, Counter, Histogram, ProcessCollector, generate_latest
from prometheus_client.core import GaugeMetricFamily, Metric
from prometheus_client.registry import Collector
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from conoid.cases.run import State

from ..service import Service

_BUCKETS = (0.005, 0.01, 0.025, 0.05, 0.1, 0.2, 0.5, 1.0, 5.0, 30.0)
"""s: bounds of the histogram. Chosen round the 50 and 200 ms that an answer may take."""


_METHODS = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})
"""That have series of their own. A caller may write any word there, and each would be kept for good."""


class Metrics:
    """Of one server."""

    def __init__(self, service: Service) -> None:
        """Counts nothing yet."""
        self.registry = CollectorRegistry()
        ProcessCollector(registry=self.registry)
        self.registry.register(_Runs(service))
        labels = ("method", "route", "status")
        self.answers = Counter("conoid_answers", "Answers by route and status.", labels, registry=self.registry)
        self.seconds = Histogram(
            "conoid_answer_seconds", "Time to the first byte of an answer.", ("method", "route"),
            buckets=_BUCKETS, registry=self.registry,
        )  # fmt: skip

    def text(self) -> bytes:
        """The text form of all."""
        return generate_latest(self.registry)

    def answered(self, scope: Scope, status: int, seconds: float) -> None:
        """Counts an answer under the pattern of its route, so that there are as many series as routes."""
        route = getattr(scope.get("route"), "path", "none")
        method = scope["method"] if scope["method"] in _METHODS else "other"
        self.answers.labels(method, route, str(status)).inc()
        self.seconds.labels(method, route).observe(seconds)


class _Runs(Collector):
    """Read from the parts of the server when somebody asks."""

    def __init__(self, service: Service) -> None:
        self._service = service

    def _counts(self) -> Counts[State]:
        """Of the runs that are there. Raises SQLAlchemyError, OSError."""
        ended = self._service.store.ended()
        gone = Counts(ended[run_id] for run_id in self._service.existing.gone(ended.keys()))
        return Counts(self._service.store.count_by_state()) - gone

    def collect(self) -> Iterable[Metric]:
        """The gauges."""
        counts = self._counts()
        runs = GaugeMetricFamily("conoid_runs", "Runs by state.", labels=["state"])
        for state in State:
            runs.add_metric([state.value], counts[state])
        yield runs
        supervisor = self._service.supervisor
        told: tuple[tuple[str, str, Callable[[], float]], ...] = (
            ("conoid_slots", "Ranks that may run at a time.", lambda: self._service.settings.slots),
            ("conoid_slots_used", "Ranks that run now.", supervisor.slots_used),
            ("conoid_listeners", "Open event streams and waiting requests.", lambda: self._service.wakeups.listening),
            ("conoid_stranded", "Open runs that nobody looks after: 0.", lambda: len(supervisor.stranded())),
        )
        for name, text, value in told:
            yield GaugeMetricFamily(name, text, value())


class Timed:
    """Middleware that counts every answer."""

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self._app, self._metrics = app, metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Passes on, and looks at the clock when the answer begins. A crash is answered farther out, with 500."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        began, answered = time.perf_counter(), False

        def count(status: int) -> None:
            nonlocal answered
            answered = True
            self._metrics.answered(scope, status, time.perf_counter() - began)

        async def told(message: Message) -> None:
            if message["type"] == "http.response.start":
                count(message["status"])
            await send(message)

        try:
            await self._app(scope, receive, told)
        except Exception:
            if not answered:
                count(500)
            raise
