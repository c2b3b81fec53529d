"""Metrics for Prometheus: runs, cores in use, streams, and the duration of requests."""

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
"""Upper bounds of the bins of the histogram of durations, s. Bounds near 50 and 200 ms are needed, because they are the
required limits for an answer (chosen values)."""


_METHODS = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})
"""HTTP methods that have a counter of their own. All other methods share one counter: a client may send any word as a
method, and counters are never removed."""


class Metrics:
    """Metrics of one server."""

    def __init__(self, service: Service) -> None:
        """Creates all counters with the value 0."""
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
        """Returns all metrics in the text form of Prometheus."""
        return generate_latest(self.registry)

    def answered(self, scope: Scope, status: int, seconds: float) -> None:
        """Counts an answer under the pattern of its route; the number of time series then does not exceed the number of
        routes.
        """
        route = getattr(scope.get("route"), "path", "none")
        method = scope["method"] if scope["method"] in _METHODS else "other"
        self.answers.labels(method, route, str(status)).inc()
        self.seconds.labels(method, route).observe(seconds)


class _Runs(Collector):
    """Metrics whose values are read from the parts of the server at each request of /metrics."""

    def __init__(self, service: Service) -> None:
        self._service = service

    def _counts(self) -> Counts[State]:
        """Returns the number of runs in each state, without runs whose folder is missing. Raises SQLAlchemyError,
        OSError.
        """
        ended = self._service.store.ended()
        gone = Counts(ended[run_id] for run_id in self._service.existing.gone(ended.keys()))
        return Counts(self._service.store.count_by_state()) - gone

    def collect(self) -> Iterable[Metric]:
        """Yields the gauges."""
        counts = self._counts()
        runs = GaugeMetricFamily("conoid_runs", "Runs by state.", labels=["state"])
        for state in State:
            runs.add_metric([state.value], counts[state])
        yield runs
        supervisor = self._service.supervisor
        gauges: tuple[tuple[str, str, Callable[[], float]], ...] = (
            ("conoid_slots", "Cores that runs may use at a time.", lambda: self._service.settings.slots),
            ("conoid_slots_used", "Cores in use by runs now.", supervisor.slots_used),
            ("conoid_listeners", "Open event streams and waiting requests.", lambda: self._service.wakeups.listening),
            (
                "conoid_stranded",
                "Open runs without supervision; 0 in normal operation.",
                lambda: len(supervisor.stranded()),
            ),
        )
        for name, text, value in gauges:
            yield GaugeMetricFamily(name, text, value())


class Timed:
    """Middleware that counts and times every answer."""

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self._app, self._metrics = app, metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Measures the time until the answer begins. After an exception, the outer middleware answers with status
        500.
        """
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        began, answered = time.perf_counter(), False

        def count(status: int) -> None:
            nonlocal answered
            answered = True
            self._metrics.answered(scope, status, time.perf_counter() - began)

        async def timed(message: Message) -> None:
            if message["type"] == "http.response.start":
                count(message["status"])
            await send(message)

        try:
            await self._app(scope, receive, timed)
        except Exception:
            if not answered:
                count(500)
            raise
