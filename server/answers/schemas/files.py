"""JSON schemas of files: files of a run, and files that a user has uploaded."""

import msgspec


class FileEntry(msgspec.Struct, kw_only=True):
    """A file of a run; ``modified`` is the Unix time of the last change of the file, s."""

    path: str
    size: int
    modified: float
    url: str


class Files(msgspec.Struct, kw_only=True):
    """All files of a run."""

    files: list[FileEntry]


class SentFile(msgspec.Struct, kw_only=True):
    """A file that a user uploads: ``offset`` of its ``size`` bytes have arrived. ``asked``: Unix time of the last
    request for the file, s.
    """

    sha256: str
    size: int
    offset: int
    whole: bool
    asked: float
    url: str


class SentFiles(msgspec.Struct, kw_only=True):
    """All files that a user has uploaded, and the sum of their sizes in bytes."""

    files: list[SentFile]
    bytes: int


class Report(msgspec.Struct, kw_only=True):
    """The report of a run: path in the run's folder, size in bytes, and address."""

    path: str
    size: int
    url: str
