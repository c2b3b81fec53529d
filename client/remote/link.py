"""Interface of a subscription to the messages of a run, for any transport."""

from typing import Protocol

from conoid.cases.messages import AnyMessage


class Link(Protocol):
    """A source of messages as they arrive; messages may be missing or repeated."""

    name: str
    trouble: str
    """Reason why no more messages arrive; empty for a working subscription."""

    def get(self, timeout: float) -> AnyMessage | None:
        """Returns the next message; None if no message arrives within ``timeout`` s."""

    def close(self) -> None:
        """Closes the subscription; a second call has no effect."""
