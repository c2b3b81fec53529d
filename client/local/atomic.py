"""Files that appear whole or not at all: what a full disk cuts off is removed, and what was there before stays."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..errors import ClientError


@contextmanager
def whole(out: Path) -> Iterator[Path]:
    """A path to write to, whose file becomes ``out`` at the end; of the same ending, by which libraries know the kind.

    What is no plain file, such as /dev/stdout, is written to as it is. Raises ClientError that names ``out``.
    """
    target = out.resolve()  # a link stays, what it names is replaced
    plain = target.is_file() or not target.exists()
    part = target.with_name(f".{target.stem}.{os.getpid()}.part{target.suffix}") if plain else target
    try:
        yield part
        if plain:
            part.replace(target)
    except OSError as error:
        raise ClientError(f"{out}: cannot be written: {error.strerror or error}") from None
    finally:
        with suppress(OSError):
            if plain:
                part.unlink(missing_ok=True)


def save_text(out: Path, text: str | bytes) -> None:
    """Writes a text, or one that is in UTF-8. Raises ClientError that names ``out``."""
    with whole(out) as part:
        part.write_bytes(text if isinstance(text, bytes) else text.encode())
