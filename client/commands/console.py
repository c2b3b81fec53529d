"""Output to the terminal. All commands print through this module only.

A title, a file name or an answer of a server may contain characters that control the terminal. An escape sequence could
rename a window, write to the clipboard or overwrite text of the terminal. Some characters reverse the direction of
text, or have no width, and could hide text. All these characters are printed as escapes such as ``\\u001b``, which are
also valid JSON.
"""

import json
import re
import sys
import warnings
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
"""Characters that are printed as escapes: control characters except tab and line end, characters that reverse or
hide text, and lone surrogates, which cannot be encoded."""
_BREAKS = re.compile(r"\r?\n")


def _escape(found: re.Match[str]) -> str:
    """Returns a character as ``\\uXXXX``; a character beyond 16 bits becomes two escapes, as in JSON."""
    return "".join(f"\\u{ord(letter):04x}" if ord(letter) < 0x10000 else _pair(letter) for letter in found[0])


def _pair(letter: str) -> str:
    high, low = divmod(ord(letter) - 0x10000, 0x400)
    return f"\\u{0xD800 + high:04x}\\u{0xDC00 + low:04x}"


def plain(text: str) -> str:
    """Returns ``text`` with escapes for the characters that control a terminal or hide text; tabs and line ends
    stay.
    """
    return _HIDDEN.sub(_escape, text)


def one_line(text: str) -> str:
    """Returns ``text`` as one line, with escapes for line ends and for hidden characters."""
    return plain(_BREAKS.sub(r"\\n", text))


def echo(thing: object = "", *, nl: bool = True, err: bool = False) -> None:
    """Prints a text, or the text ``str(thing)`` of an object."""
    with named("standard error" if err else "standard output"):
        typer.echo(plain(str(thing)), nl=nl, err=err)


def echo_json(thing: Any, *, indent: bool = True) -> None:
    """Prints a JSON document, indented or on one line. Numbers that are not finite become null."""
    try:
        text = msgspec.json.encode(thing)
    except UnicodeEncodeError:  # The text has a path that is not UTF-8.
        text = json.dumps(msgspec.to_builtins(thing)).encode()
    echo((msgspec.json.format(text, indent=2) if indent else text).decode())


def _show_warning(message: Warning | str, *_: object, **__: object) -> None:
    echo(f"conoid: warning: {one_line(str(message))}", err=True)


def prepare() -> None:
    """Makes this process print each warning in one line. Characters that the encoding of the terminal lacks are
    printed as escapes."""
    warnings.showwarning = _show_warning
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")


class PlainConsole(Console):
    """A console of rich that prints text literally, in tables and panels as well: without markup and names of emoji.
    Colours that the program itself sets are kept.
    """

    def __init__(self, **options: Any) -> None:
        """``options``: arguments of rich's Console."""
        super().__init__(**{"markup": False, "emoji": False, "highlight": False, **options})

    def print(self, *things: Any, **options: Any) -> None:
        """Writes a text to the stream. Raises OSError with the name of the stream."""
        with named("standard output"):
            super().print(*things, **options)

    def render_str(self, text: str, **options: Any) -> Text:
        """Replaces characters by escapes before rich computes the layout, because an escape is wider than its
        character.
        """
        return super().render_str(plain(text), **options)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Yields the segments of ``renderable``, with escapes for control characters."""
        for text, style, control in super().render(renderable, options):
            yield Segment(text if control else plain(text), style, control)
