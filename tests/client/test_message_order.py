"""Messages arrive in order and once each, for any loss, repetition or order of messages in the stream."""

import random

import pytest

from conoid.cases.messages import AnyMessage, Log
from conoid.client.remote.message_order import InOrder


def message(seq: int) -> Log:
    return Log(run="r", seq=seq, level="info", text=str(seq))


class Journal:
    """A fake journal of which the lines up to ``written`` exist; the journal counts how often it is read."""

    def __init__(self, written: int = 0) -> None:
        self.written = written
        self.asked: list[int] = []

    def after(self, last: int) -> list[AnyMessage]:
        self.asked.append(last)
        return [message(seq) for seq in range(last + 1, self.written + 1)]


def seqs(order: InOrder, *arriving: int) -> list[int]:
    return [passed.seq for seq in arriving for passed in order.take(message(seq))]


def test_messages_in_order_need_no_journal() -> None:
    journal = Journal(3)
    assert seqs(InOrder(journal.after), 1, 2, 3) == [1, 2, 3]
    assert journal.asked == []


def test_a_gap_is_refilled_once() -> None:
    journal = Journal(7)
    order = InOrder(journal.after)
    assert seqs(order, 1, 2, 6, 7, 3, 6) == [1, 2, 3, 4, 5, 6, 7]
    assert journal.asked == [2]
    assert order.missing == 0


def test_a_late_subscriber_reads_the_history_first() -> None:
    order = InOrder(Journal(4).after)
    history = [passed.seq for passed in order.catch_up()]
    assert history + seqs(order, 3, 4, 5) == [1, 2, 3, 4, 5]


def test_reading_goes_on_after_a_known_number() -> None:
    order = InOrder(Journal(9).after, after=5)
    assert seqs(order, 4, 5, 8) == [6, 7, 8, 9]


def test_a_journal_that_lags_is_asked_again_and_a_hole_does_not_stop_the_stream() -> None:
    journal = Journal(1)
    order = InOrder(journal.after, pause=0.0)
    assert seqs(order, 1, 4) == [1, 4]
    assert len(journal.asked) == 3
    assert order.missing == 2


@pytest.mark.parametrize("seed", range(20))
def test_any_loss_repeat_and_disorder_gives_the_journal(seed: int) -> None:
    dice = random.Random(seed)
    journal = Journal()
    order = InOrder(journal.after)
    passed: list[int] = []
    late: list[int] = []
    for seq in range(1, 200):
        journal.written = seq
        late.append(seq)
        if dice.random() < 0.3:
            dice.shuffle(late)
            passed += seqs(order, *[each for each in late if dice.random() < 0.7], *late[:2])
            late = []
    passed += [each.seq for each in order.catch_up()]
    assert passed == list(range(1, 200))
