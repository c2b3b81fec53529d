"""Uploaded files: plain files in ``<runs>/uploads/<owner>/``, each named by its SHA-256 hash.

::

    <sha256>              complete: the content has this hash, and never changes
    <sha256>.<size>.part  incomplete: its length is the number of arrived bytes, of ``size``

Each user has a folder, and every request reads only the folder of its user; so no user can find out what others have
uploaded. The folder of a run gets a hard link to each file that its case names (``give``). The link stays when the
uploaded file is removed. The access time of an uploaded file is set to the time of the last request for this file.
"""

import os
import shutil
import threading
import time
from collections.abc import Callable, Container
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from conoid.cases.figures import size
from conoid.cases.reading.files import HASH
from conoid.cases.site.policy import Files

from .. import durable
from ..errors import ServiceError
from ..requests.limits import later

FOLDER = "uploads"
_PART = ".part"
_SYNCED = 1 << 26
"""Number of bytes after which arrived data is flushed to disk (chosen value). A slow disk takes one second to flush
them, which is the largest delay of a write."""


@dataclass(frozen=True)
class Upload:
    """An uploaded file of a user. ``offset`` of its ``size`` bytes have arrived; ``asked``: Unix time of the last
    request for the file, s.
    """

    sha256: str
    size: int
    offset: int
    whole: bool
    asked: float


class Part:
    """An incomplete uploaded file, open for writing. The file is closed when no reference to this object is left,
    because a thread may still write to a hanging disk after its request was given up.
    """

    def __init__(self, path: Path, size: int, *, anew: bool) -> None:
        """Opens the file. Raises OSError if the file cannot be opened or is a link."""
        flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC | (os.O_TRUNC if anew else 0)
        self._fd = os.open(path, flags, 0o600)
        self.path, self.size = path, size
        self.offset = os.fstat(self._fd).st_size
        self._unsynced = 0

    def __del__(self) -> None:
        """Closes the file."""
        with suppress(AttributeError):
            os.close(self._fd)

    def write(self, data: bytes) -> None:
        """Appends bytes. Raises OSError."""
        view = memoryview(data)
        while view:
            written = os.pwrite(self._fd, view, self.offset)
            self.offset += written
            self._unsynced += written
            view = view[written:]
        if self._unsynced >= _SYNCED:
            self.sync()

    def sync(self) -> None:
        """Flushes the data to disk. Raises OSError."""
        os.fsync(self._fd)
        self._unsynced = 0

    def read(self, most: int, offset: int) -> bytes:
        """Returns a range of the arrived bytes. Raises OSError if the file cannot be read."""
        return os.pread(self._fd, most, offset)


class Uploads:
    """Uploaded files of all users. All methods of this class may be called from any thread. Nothing is kept in memory:
    every method reads the folder.
    """

    def __init__(self, runs: Path, rules: Files, free_disk: int) -> None:
        """Creates the object. ``rules``: limits of the site; ``free_disk``: bytes of the disk that must stay free."""
        self._runs, self._folder, self._rules, self._free_disk = runs, runs / FOLDER, rules, free_disk
        self._locks: dict[str, threading.Lock] = {}
        self.left: Callable[[str], int | None] = lambda owner: None
        """Function that returns how many more bytes an owner may have on disk; None: no further limit than
        ``rules``."""

    def _lock(self, owner: str) -> threading.Lock:
        """Returns the lock of an owner; users do not wait for each other."""
        return self._locks.setdefault(owner, threading.Lock())

    def of(self, owner: str) -> list[Upload]:
        """Returns all uploaded files of an owner, by hash. Raises OSError if the folder cannot be read."""
        try:
            with os.scandir(self._folder / owner) as entries:
                found = [sent for entry in entries if (sent := _sent(entry)) is not None]
        except FileNotFoundError:
            return []
        return sorted(found, key=lambda sent: sent.sha256)

    def find(self, owner: str, sha256: str) -> Upload | None:
        """Returns an uploaded file of an owner, complete or incomplete, and sets the time of its last request. Raises
        OSError if the file cannot be read.
        """
        with self._lock(owner):
            for path in self._paths(owner, sha256):
                with suppress(FileNotFoundError):
                    status = os.stat(path, follow_symlinks=False)
                    _want(path, status)
                    return _upload_of(path.name, status)
        return None

    def _paths(self, owner: str, sha256: str) -> list[Path]:
        """Returns the paths of the complete and the incomplete file."""
        folder = self._folder / owner
        return [folder / sha256, *(p for p in folder.glob(f"{sha256}.*{_PART}") if _size_of(p.name) is not None)]

    def begin(self, owner: str, sha256: str, total: int, first: int | None = None) -> Part:
        """Opens the incomplete file at the byte ``first`` for writing; ``first`` None: begins a new file. From now on
        the whole size of the file counts as disk usage of its owner. Raises ServiceError with status 409, 413, 429 or
        507; raises OSError.
        """
        path = self._folder / owner / f"{sha256}.{total}{_PART}"
        with self._lock(owner):
            for other in self._paths(owner, sha256)[1:]:
                if other != path:
                    other.unlink(missing_ok=True)
            there = path.stat().st_size if path.exists() else None
            if first not in {None, there or 0}:
                raise _wrong_offset(there or 0, first)
            if there is None:
                self._check_room(owner, total)
            self._check_disk(total - (first or 0))
            path.parent.mkdir(0o700, parents=True, exist_ok=True)
            return Part(path, total, anew=first is None)

    def _check_room(self, owner: str, total: int) -> None:
        rules, there = self._rules, self.of(owner)
        hint = f"a file that no run uses is removed {rules.age} after its last request, or by DELETE /v1/files/SHA256"
        if total > rules.size:
            message = f"the file has {size(total)}; this server allows {size(rules.size)}"
            raise ServiceError(413, "too_large", message)
        if len(there) >= rules.number:
            raise later("file_quota", f"you have uploaded {len(there)} files; this server allows {rules.number}", hint)
        sent = sum(each.size for each in there)
        if sent + total > rules.bytes:
            message = f"the file has {size(total)}, and your files {size(sent)}; this server allows {size(rules.bytes)}"
            raise later("file_quota", message, hint)
        left = self.left(owner)
        if left is not None and total > left:
            message = (
                f"the file has {size(total)}, and you may have {size(max(0, left))} more on disk: remove some runs"
            )
            raise later("output_quota", message)

    def _check_disk(self, more: int) -> None:
        free = shutil.disk_usage(self._runs).free - more
        if free < self._free_disk:
            detail = f"the server's disk has no space for {size(more)}; {size(self._free_disk)} must stay free"
            raise ServiceError(507, "disk_full", detail, retryable=True)

    def finish(self, owner: str, part: Part) -> None:
        """Gives a complete and verified file its final name, and flushes it to disk.

        Raises OSError.
        """
        part.sync()
        whole = part.path.with_name(part.path.name.partition(".")[0])
        with self._lock(owner):
            os.chmod(part.path, 0o400)
            _want(part.path, os.stat(part.path))
            os.replace(part.path, whole)
            durable.sync_folder(whole.parent)

    def give(self, owner: str, sha256: str, target: Path) -> None:
        """Makes a hard link to an uploaded file at the path ``target`` in the folder of a run. Raises
        FileNotFoundError, OSError.
        """
        with self._lock(owner):
            give(self._folder / owner / sha256, target)

    def remove(self, owner: str, sha256: str) -> bool:
        """Removes an uploaded file, complete or incomplete; returns False if the file does not exist. Runs keep their
        copies. Raises OSError.
        """
        with self._lock(owner):
            there = [path for path in self._paths(owner, sha256) if path.exists()]
            for path in there:
                path.unlink(missing_ok=True)
        return bool(there)

    def purge(self, now: float, needed: Container[str] = ()) -> list[str]:
        """Removes the files that no run uses and that no request has named for the time that the site allows, except
        those in ``needed``. Returns a line of text for each. A file that a run also uses stays, because it takes no
        additional space. Raises OSError.
        """
        gone: list[str] = []
        for owner in self.owners():
            hashes = [sent.sha256 for sent in self.of(owner) if sent.sha256 not in needed]
            gone += [f"file {sha256} of {owner}" for sha256 in hashes if self._dropped(owner, sha256, now)]
            with self._lock(owner), suppress(OSError):
                (self._folder / owner).rmdir()  # this fails if the folder is not empty
        return gone

    def _dropped(self, owner: str, sha256: str, now: float) -> bool:
        """Removes the file if it is old enough. Returns whether it was removed. The lock of the owner prevents requests
        for the file meanwhile.
        """
        with self._lock(owner):
            for path in self._paths(owner, sha256):
                with suppress(FileNotFoundError):
                    status = os.stat(path, follow_symlinks=False)
                    if status.st_nlink > 1 or now - _asked(path.name, status) <= self._rules.oldest:
                        return False
                    path.unlink()
        return True

    def owners(self) -> list[str]:
        """Returns the users who have uploaded files. Raises OSError."""
        try:
            return sorted(entry.name for entry in os.scandir(self._folder) if entry.is_dir(follow_symlinks=False))
        except FileNotFoundError:
            return []

    def weigh(self, owner: str) -> dict[tuple[int, int], int]:
        """Returns the size in bytes of each file of an owner, by device and inode; a hard link in a run's folder has
        the same inode.
        """
        found: dict[tuple[int, int], int] = {}
        with suppress(FileNotFoundError), os.scandir(self._folder / owner) as entries:
            for entry in entries:
                with suppress(FileNotFoundError):
                    status = entry.stat(follow_symlinks=False)
                    found[status.st_dev, status.st_ino] = status.st_size
        return found


def _wrong_offset(there: int, first: int | None) -> ServiceError:
    detail = f"the server has {there} bytes of the file, and the body begins at {first}"
    headers = {"Upload-Offset": str(there)}
    return ServiceError(409, "wrong_offset", detail, pointer="Content-Range", headers=headers)


def give(source: Path, target: Path) -> None:
    """Makes a hard link to a file that never changes; copies the file if the file system has no hard links. The file
    and its folder are flushed to disk before the function returns. Raises FileNotFoundError, OSError.
    """
    try:
        os.link(source, target, follow_symlinks=False)
    except FileNotFoundError:
        raise
    except OSError:
        durable.copy(source, target)


def _want(path: Path, status: os.stat_result) -> None:
    """Sets the time of the last request for a file to now."""
    os.utime(path, ns=(time.time_ns(), status.st_mtime_ns), follow_symlinks=False)


def _sent(entry: "os.DirEntry[str]") -> Upload | None:
    """Returns the upload that a folder entry contains; None for other files, and for a file that was just removed."""
    with suppress(FileNotFoundError):
        return _upload_of(entry.name, entry.stat(follow_symlinks=False))
    return None


def _upload_of(name: str, status: os.stat_result) -> Upload | None:
    sha256, _, rest = name.partition(".")
    if not HASH.fullmatch(sha256) or (rest and _size_of(name) is None):
        return None
    there, asked = status.st_size, _asked(name, status)
    return Upload(sha256, _size_of(name) if rest else there, there, not rest, asked)  # type: ignore[arg-type]


def _asked(name: str, status: os.stat_result) -> float:
    """Returns the Unix time of the last request for the file, or of its last arrived byte, s."""
    return max(status.st_atime, status.st_mtime) if name.endswith(_PART) else status.st_atime


def _size_of(name: str) -> int | None:
    """Returns the final size of an incomplete file from its name; None if the name is not that of an incomplete
    file.
    """
    size_, _, ending = name.partition(".")[2].partition(".")
    return int(size_) if size_.isdecimal() and f".{ending}" == _PART else None
