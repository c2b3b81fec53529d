"""A request to stop from outside: SIGTERM, SIGUSR1 or SIGINT raise a flag; the next step's reduction carries it."""

import signal

REQUESTS = (signal.SIGTERM, signal.SIGUSR1, signal.SIGINT)


class Signals:
    """Listens from its making on; the set-up of a run is finished before the flag is looked at."""

    def __init__(self) -> None:
        self.raised = False
        for number in REQUESTS:
            signal.signal(number, self._on_signal)

    def _on_signal(self, number: int, stack: object) -> None:
        self.raised = True
