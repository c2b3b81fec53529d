"""Subscription over Zenoh with a real router and real messages; a list in memory replaces the journal of the server."""

import threading
import time
from collections.abc import Callable, Iterator

import msgspec
import pytest

from conoid.cases.messages import AnyMessage, Log
from conoid.cases.output import keys
from conoid.client.errors import AnswerError, UnreachableError
from conoid.client.remote import stream
from conoid.client.remote.http import Router
from conoid.client.remote.link import Link
from conoid.client.remote.stream import SseLink, StreamError, ZenohLink, follow

from . import run_messages
from .fakes import OWNER, Broker, free_port

PREFIX = keys.run_prefix(OWNER, run_messages.RUN)


class Journal:
    """Messages that are written so far; ``reads`` counts how often the messages are read."""

    def __init__(self) -> None:
        self.lines: list[AnyMessage] = []
        self.reads = 0

    def after(self, last: int) -> list[AnyMessage]:
        self.reads += 1
        return [message for message in self.lines if message.seq > last]


@pytest.fixture(autouse=True)
def _short_silence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stream, "_SILENCE", 0.3)


def reading(
    link: Link, journal: Journal, ended: Callable[[], bool] = lambda: False
) -> tuple[list[int], threading.Thread]:
    """Follows a run in a thread and returns a list that receives the numbers of the messages."""
    received: list[int] = []

    def read() -> None:
        for message in follow(link, journal.after, ended):
            received.append(message.seq)  # noqa: PERF401  (it is looked at while it grows)

    thread = threading.Thread(target=read, daemon=True)
    thread.start()
    return received, thread


def subscribed(broker: Broker) -> ZenohLink:
    """Opens a subscription and waits until the router has it, because a declaration takes a moment to arrive. The
    messages that are sent during this wait have seq 0.
    """
    link = ZenohLink(broker.router, PREFIX)
    deadline = time.monotonic() + 10
    broker.publish(run_messages.status(0, "running"))
    while link.get(0.02) is None:
        assert time.monotonic() < deadline
        broker.publish(run_messages.status(0, "running"))
    while link.get(0.05) is not None:
        pass
    return link


def until(truth: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 10
    while not truth():
        assert time.monotonic() < deadline
        time.sleep(0.005)


def test_a_late_subscriber_reads_history_then_stream_without_gap_or_repeat(broker: Broker) -> None:
    journal, story = Journal(), run_messages.whole()
    journal.lines = story[:6]
    link = subscribed(broker)
    broker.publish(story[4])  # this message arrived during the subscription
    received, thread = reading(link, journal)
    until(lambda: len(received) == 6)
    for message in story[6:]:
        journal.lines.append(message)
        broker.publish(message)
    thread.join(10)
    assert received == list(range(1, 16))
    assert journal.reads == 1, "the other messages came from the stream"


def test_a_gap_is_refilled_from_the_journal(broker: Broker) -> None:
    journal, story = Journal(), run_messages.whole()
    received, thread = reading(subscribed(broker), journal)
    until(lambda: journal.reads == 1)
    for message in story:
        journal.lines.append(message)
        if message.seq not in {3, 4, 9}:
            broker.publish(message)
    thread.join(10)
    assert received == list(range(1, 16))


def test_no_message_is_lost_when_a_router_stops_sending(broker: Broker) -> None:
    journal, story = Journal(), run_messages.whole()
    received, thread = reading(subscribed(broker), journal)
    broker.publish(story[0])
    journal.lines = story
    thread.join(10)
    assert received == list(range(1, 16)), "the journal is polled while nothing comes"


def test_a_run_that_ended_without_a_last_word_ends_the_stream(broker: Broker) -> None:
    journal = Journal()
    journal.lines = run_messages.whole()[:9]
    received, thread = reading(subscribed(broker), journal, ended=lambda: True)
    thread.join(10)
    assert not thread.is_alive()
    assert received == list(range(1, 10))


def test_messages_of_other_runs_and_invalid_ones_are_ignored(broker: Broker) -> None:
    link = subscribed(broker)
    try:
        other = msgspec.structs.replace(run_messages.status(1, "running"), run="r2")
        broker.publish(other)
        broker.session.put(f"{PREFIX}/event", b"not a message")
        broker.publish(run_messages.status(2, "queued"))
        first = link.get(5.0)
        assert first == run_messages.status(2, "queued")
        assert link.get(0.05) is None
    finally:
        link.close()


def test_a_wrong_password_is_reported(broker: Broker) -> None:
    wrong = Router(endpoint=broker.router.endpoint, user="ann", password="guess")
    with pytest.raises(StreamError, match="refused or cannot be reached"):
        ZenohLink(wrong, PREFIX)


def test_a_missing_router_is_reported_at_once() -> None:
    began = time.monotonic()
    with pytest.raises(StreamError):
        ZenohLink(Router(endpoint=f"tcp/127.0.0.1:{free_port()}"), PREFIX)
    assert time.monotonic() - began < 6.0


def test_sse_sends_the_same_messages_and_a_gap_is_read_from_the_journal() -> None:
    journal, story = Journal(), run_messages.whole()
    journal.lines = story

    def events() -> Iterator[AnyMessage]:
        yield from story[2:5]
        raise UnreachableError("the proxy gave up")

    received, thread = reading(SseLink(events), journal)
    thread.join(10)
    assert received == list(range(1, 16))


def test_a_server_that_restarts_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("conoid.client.remote.stream.time.sleep", lambda _: None)
    journal = Journal()
    journal.lines = run_messages.whole()
    failures = iter([True, True, False])

    def refill(after: int) -> list[AnyMessage]:
        if next(failures):
            raise UnreachableError("no answer")
        return journal.after(after)

    link = SseLink(lambda: iter(()))
    assert [message.seq for message in follow(link, refill, lambda: False)] == list(range(1, 16))


def test_an_unreachable_server_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stream, "_PATIENCE", 0.0)

    def refill(_after: int) -> list[AnyMessage]:
        raise UnreachableError("no answer from http://127.0.0.1:1")

    with pytest.raises(UnreachableError, match="no answer"):
        list(follow(SseLink(lambda: iter(())), refill, lambda: False))


def test_a_full_mailbox_drops_instead_of_waiting() -> None:
    mailbox = stream.Mailbox()
    for seq in range(1, stream._CAPACITY + 100):
        mailbox.put(run_messages.status(seq, "running"))
    first = mailbox.get(0.0)
    assert first is not None
    assert first.seq == 1


def test_an_unreadable_stream_is_reported_once_and_the_journal_is_read() -> None:
    def unreadable() -> Iterator[AnyMessage]:
        raise AnswerError("the answer of http://conoid.test cannot be read")
        yield

    journal = Journal()
    journal.lines = [run_messages.status(1, "running"), run_messages.status(2, "succeeded")]
    link = SseLink(unreadable)
    until(lambda: bool(link.trouble))
    warning, *received = follow(link, journal.after, lambda: True)
    assert [message.seq for message in received] == [1, 2]
    assert isinstance(warning, Log)
    assert warning.text.startswith(
        "the event stream of the server broke, and the journal is read instead: the answer of http"
    )
