"""The terminal: what a case, a run or a server says is shown there, and does nothing else to it.

A title may hold any character. An escape sequence in it would rename windows, write the clipboard or paint over lines.
"""

import re
from collections.abc import Iterable

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069]")
"""Control characters but tab and line feed, and those that turn the direction of text."""


def plain(text: str) -> str:
    """``text`` with a replacement character for each that a terminal would obey."""
    return _CONTROL.sub("\N{REPLACEMENT CHARACTER}", text)


class PlainConsole(Console):
    """A console on which text is text, wherever in a table or panel it stands; its own colours stay."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """The segments of ``renderable``, without what a terminal would obey."""
        for text, style, control in super().render(renderable, options):
            yield Segment(text if control else plain(text), style, control)
