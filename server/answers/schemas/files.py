"""Files of a run, and files that a user has sent."""

import msgspec


class FileEntry(msgspec.Struct, kw_only=True):
    """A file of a run; ``modified`` in Unix s."""

    path: str
    size: int
    modified: float
    url: str


class Files(msgspec.Struct, kw_only=True):
    """All files of a run."""

    files: list[FileEntry]


class SentFile(msgspec.Struct, kw_only=True):
    """A file that a user has sent: ``offset`` of its ``size`` bytes have arrived. ``asked``: last request, Unix s."""

    sha256: str
    size: int
    offset: int
    whole: bool
    asked: float
    url: str


class SentFiles(msgspec.Struct, kw_only=True):
    """All files that a user has sent, and the sum of their sizes in bytes."""

    files: list[SentFile]
    bytes: int


class Report(msgspec.Struct, kw_only=True):
    """The report of a run: its path in the run's folder, its size in bytes, its address."""

    path: str
    size: int
    url: str
