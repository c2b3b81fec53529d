"""Requests to stop by the signals SIGTERM, SIGUSR1 and SIGINT. A signal sets a flag. The reduction of the next step
sends the flag to all ranks.
"""

import signal

REQUESTS = (signal.SIGTERM, signal.SIGUSR1, signal.SIGINT)


class Signals:
    """Handlers of the signals. The constructor installs the handlers. The flag is not read before the run has
    started.
    """

    def __init__(self) -> None:
        self.raised = False
        for number in REQUESTS:
            signal.signal(number, self._on_signal)

    def _on_signal(self, number: int, stack: object) -> None:
        self.raised = True
