"""Files that are written completely or not at all: after an error the incomplete file is removed, and an earlier one
stays."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..errors import ClientError


@contextmanager
def whole(out: Path) -> Iterator[Path]:
    """Yields a path to write to, whose file replaces ``out`` at the end; it has the same ending, by which libraries
    choose the format. A target that is not a regular file, such as /dev/stdout, is written directly. Raises
    ClientError with the name of ``out``.
    """
    target = out.resolve()  # a link is kept, its target is replaced
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
    """Writes a text or bytes in UTF-8. Raises ClientError with the name of ``out``."""
    with whole(out) as part:
        part.write_bytes(text if isinstance(text, bytes) else text.encode())
