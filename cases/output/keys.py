"""Zenoh key expressions, built in one place: ``conoid/v1/<owner>/<run>/<class>``.

The owner stands in the key so that access rules are per user. A chunk that starts with ``@`` would be invisible
to wildcards, so the version is a plain ``v1``.
"""

import re

ROOT = "conoid/v1"
CLASSES = ("state", "event", "load", "counts", "fragments", "log")
_CHUNK = re.compile(r"[A-Za-z0-9_.:-]+")


def _chunk(text: str) -> str:
    if not _CHUNK.fullmatch(text):
        raise ValueError(f"{text!r} cannot stand in a key; allowed: letters, digits and _ . : -")
    return text


def run_prefix(owner: str, run: str) -> str:
    """``conoid/v1/<owner>/<run>``: everything a run says lies below it."""
    return f"{ROOT}/{_chunk(owner)}/{_chunk(run)}"


def message_key(prefix: str, kind: str) -> str:
    """The key of a message class below a run's prefix. Raises ValueError for an unknown class."""
    if kind not in CLASSES:
        raise ValueError(f"unknown message class {kind!r}; known: {', '.join(CLASSES)}")
    return f"{prefix}/{kind}"


def everything(prefix: str) -> str:
    """All messages of a run, or of an owner when given the owner's prefix."""
    return f"{prefix}/**"


def alive(prefix: str) -> str:
    """The liveliness token that stands while the run's worker lives."""
    return f"{prefix}/alive"


def owner_prefix(owner: str) -> str:
    """``conoid/v1/<owner>``."""
    return f"{ROOT}/{_chunk(owner)}"
