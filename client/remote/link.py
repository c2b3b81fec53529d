"""Interface of a subscription to a run's messages, over any transport."""

from typing import Protocol

from conoid.cases.messages import AnyMessage


class Link(Protocol):
    """A source of messages as they arrive, possibly with gaps and repetitions."""

    name: str
    trouble: str
    """Reason for which no message arrives any more; empty for a working subscription."""

    def get(self, timeout: float) -> AnyMessage | None:
        """Returns the next message; None after ``timeout`` s without one."""

    def close(self) -> None:
        """Closes the subscription; a second call has no effect."""
