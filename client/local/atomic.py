"""Files that are written completely or not at all. After an error the incomplete file is removed, and an existing
file stays unchanged.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..errors import ClientError


@contextmanager
def whole(out: Path) -> Iterator[Path]:
    """Yields a path to write to. At the end, the file at this path replaces ``out``. The temporary name has the ending
    of the final name, because libraries choose the format by the ending.

    A target that is not a regular file, such as /dev/stdout, is written directly. Raises ClientError with the name
    of ``out``.
    """
    target = out.resolve()  # The file to which a link points is replaced; the link stays.
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
    """Writes bytes, or a text in UTF-8, into a file. Raises ClientError with the name of ``out``."""
    with whole(out) as part:
        part.write_bytes(text if isinstance(text, bytes) else text.encode())
