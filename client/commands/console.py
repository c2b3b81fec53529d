"""The border to the terminal: every command prints through this module, and through nothing else.

A title, a file name or an answer of a server may hold any character. An escape sequence would rename windows, write the
clipboard or paint over lines; characters that turn the direction of text, or have no width, would show another text
than there is. All of them are printed as their escape, such as ``\\u001b``, which is also right inside JSON.
"""

import json
import re
import sys
from collections.abc import Iterable
from typing import Any

import msgspec
import typer
from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from conoid.cases.reading.whole import named

_HIDDEN = re.compile(
    r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\xad\u034f\u061c\u115f\u1160\u17b4\u17b5\u180b-\u180f\u200b-\u200f"
    r"\u2028-\u202e\u2060-\u206f\u3164\ufeff\uffa0\ufff9-\ufffb\ud800-\udfff\U000e0000-\U000e0fff]|\r(?!\n)"
)
"""Control characters but tab and line end; what turns or hides text; halves of characters, which cannot be written."""
_BREAKS = re.compile(r"\r?\n")


def _escape(found: re.Match[str]) -> str:
    """``\\uXXXX``, of a character beyond 16 bits twice, as JSON has it."""
    return "".join(f"\\u{ord(letter):04x}" if ord(letter) < 0x10000 else _pair(letter) for letter in found[0])


def _pair(letter: str) -> str:
    high, low = divmod(ord(letter) - 0x10000, 0x400)
    return f"\\u{0xD800 + high:04x}\\u{0xDC00 + low:04x}"


def plain(text: str) -> str:
    """``text`` with the escape of each character that a terminal would obey or hide; tabs and line ends stay."""
    return _HIDDEN.sub(_escape, text)


def one_line(text: str) -> str:
    """``text`` as one line: line ends are escaped, too."""
    return plain(_BREAKS.sub(r"\\n", text))


def echo(thing: object = "", *, nl: bool = True, err: bool = False) -> None:
    """Prints a text, or what ``str`` makes of ``thing``."""
    with named("standard error" if err else "standard output"):
        typer.echo(plain(str(thing)), nl=nl, err=err)


def echo_json(thing: Any, *, indent: bool = True) -> None:
    """Prints one JSON document, without ``indent`` on one line. Numbers that are not finite become null."""
    try:
        text = msgspec.json.encode(thing)
    except UnicodeEncodeError:  # a path that is no UTF-8
        text = json.dumps(msgspec.to_builtins(thing)).encode()
    echo((msgspec.json.format(text, indent=2) if indent else text).decode())


def prepare() -> None:
    """Makes this process print, on a terminal of any encoding, what the encoding lacks as an escape."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")


class PlainConsole(Console):
    """A console on which text is text, wherever in a table or panel it stands: no markup, no names of emoji. Its own
    colours stay.
    """

    def __init__(self, **options: Any) -> None:
        """``options`` are those of rich."""
        super().__init__(**{"markup": False, "emoji": False, "highlight": False, **options})

    def print(self, *things: Any, **options: Any) -> None:
        """Raises OSError that names the stream."""
        with named("standard output"):
            super().print(*things, **options)

    def render_str(self, text: str, **options: Any) -> Text:
        """Escaped before anything is laid out: an escape takes up room."""
        return super().render_str(plain(text), **options)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """The segments of ``renderable``, without what a terminal would obey."""
        for text, style, control in super().render(renderable, options):
            yield Segment(text if control else plain(text), style, control)
