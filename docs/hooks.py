"""Hooks of the documentation site: links to files outside docs/ become plain text, since the site has no such page."""

import re
from typing import Any

_OUTSIDE = re.compile(r"\[([^\]]+)\]\((?:\.\./)+(?:deploy|cases|tests|client|server|worker)[^)]*\)")


def on_page_markdown(markdown: str, **_: Any) -> str:
    """The text of a page as the site shows it."""
    return _OUTSIDE.sub(r"`\1`", markdown)
