"""Zenoh key expressions: ``conoid/v1/<owner>/<run>/<class>``.

The key contains the owner, so that access rules apply to each user. The version in the key is the plain text ``v1``:
Zenoh wildcards do not match a chunk that starts with ``@``.
"""

import re

ROOT = "conoid/v1"
CLASSES = ("state", "event", "load", "counts", "fragments", "log")
_CHUNK = re.compile(r"[A-Za-z0-9_.:-]+")


def _chunk(text: str) -> str:
    if not _CHUNK.fullmatch(text):
        raise ValueError(f"{text!r} is not allowed in a Zenoh key; allowed: letters, digits and _ . : -")
    return text


def run_prefix(owner: str, run: str) -> str:
    """Prefix of all keys of a run: ``conoid/v1/<owner>/<run>``."""
    return f"{ROOT}/{_chunk(owner)}/{_chunk(run)}"


def message_key(prefix: str, kind: str) -> str:
    """Returns the key of a message class of a run; ``prefix``: prefix of the keys of the run. Raises ValueError if the
    message class is unknown.
    """
    if kind not in CLASSES:
        raise ValueError(f"unknown message class {kind!r}; known: {', '.join(CLASSES)}")
    return f"{prefix}/{kind}"


def everything(prefix: str) -> str:
    """Returns the key expression that matches all messages of a run; with the prefix of an owner, all messages of the
    owner's runs.
    """
    return f"{prefix}/**"


def alive(prefix: str) -> str:
    """Returns the key of the Zenoh liveliness token of a run; the token exists as long as the worker process of the
    run.
    """
    return f"{prefix}/alive"


def owner_prefix(owner: str) -> str:
    """Prefix of all keys of an owner: ``conoid/v1/<owner>``."""
    return f"{ROOT}/{_chunk(owner)}"
