"""A subscription to a run's messages, whatever carries them."""

from typing import Protocol

from conoid.cases.messages import AnyMessage


class Link(Protocol):
    """Messages as they arrive, perhaps with gaps and repeats."""

    name: str
    trouble: str
    """Why nothing comes by it any more; empty where something may."""

    def get(self, timeout: float) -> AnyMessage | None:
        """The next message; None after ``timeout`` s without one."""

    def close(self) -> None:
        """Lets go; a second call does nothing."""
