"""JSON schemas of cases: the check of a case, and the shipped cases."""

from typing import Any

import msgspec

from .problems import ProblemEntry


class NamedFile(msgspec.Struct, kw_only=True):
    """A file that a case names, with its SHA-256 hash."""

    path: str
    sha256: str


class CaseFile(msgspec.Struct, kw_only=True):
    """A file that the table ``key`` of a case names; ``sha256`` is empty if the case gives no hash."""

    key: str
    path: str
    sha256: str


class Validation(msgspec.Struct, kw_only=True):
    """Result of the check of a case. The answer for a valid case has warnings, an estimate, the case with all defaults,
    and a survey of the mesh files.
    """

    valid: bool
    problems: list[ProblemEntry]
    warnings: list[ProblemEntry] = []
    estimate: dict[str, float] = {}
    case: dict[str, Any] = {}
    files: list[CaseFile] = []
    survey: dict[str, Any] = {}


class GalleryEntry(msgspec.Struct, kw_only=True):
    """A shipped case."""

    name: str
    title: str
    description: str
    url: str


class Gallery(msgspec.Struct, kw_only=True):
    """All shipped cases."""

    cases: list[GalleryEntry]
