"""Capture of the text that a library prints on standard output."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def captured() -> Iterator[bytearray]:
    """Collect the bytes that this process prints within the ``with`` block. The bytes are available after the block."""
    text = bytearray()
    with tempfile.TemporaryFile() as file:
        before = os.dup(1)
        os.dup2(file.fileno(), 1)
        try:
            yield text
        finally:
            os.dup2(before, 1)
            os.close(before)
            file.seek(0)
            text += file.read()
