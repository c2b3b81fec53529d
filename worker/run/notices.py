"""Messages of the time loop for the journal. Each message has the step and the time at which it is written."""

from typing import Any

from conoid.cases import messages

from ..clock import Clock
from ..output.journal import Journal


class Notices:
    """Writes messages to the journal on rank 0. On other ranks its methods do nothing."""

    def __init__(self, journal: Journal | None) -> None:
        """``journal``: None on all ranks except 0."""
        self.journal = journal

    def write(self, clock: Clock, kind: type[messages.Message], **fields: Any) -> None:
        """Write one message of this ``kind``. Raises OSError."""
        if self.journal is not None:
            self.journal.write(kind, clock.step, clock.t, **fields)
