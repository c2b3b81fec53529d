"""Submission of cases with files: files that the server lacks are sent before the case."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from conoid.cases.load import CaseError, Overrides, apply_overrides
from conoid.cases.reading.files import files_of
from conoid.cases.reading.problems import dotted

from ..local.local_files import Hashes, with_hashes
from ..sweeps.sweep import Point
from .http import Http
from .sending import send
from .submission import CaseSource, body_of, data_of, folder_of, to_json

SURVEY = 330.0
"""Time limit for the answer to a case with files, s. The server reads the files before it answers, within at most 300 s
(server/intake/reader.py) (chosen value)."""
_POINT = 30.0
"""Additional time, s, for each point of a sweep whose files differ from those of the point before (chosen value)."""


class Outbox:
    """Uploader of files of cases. A file is hashed again only if it has changed."""

    def __init__(self, http: Http) -> None:
        """``http``: client of the server; nothing is sent yet."""
        self._http, self._hashes = http, Hashes()
        self.say: Callable[[str], None] = lambda text: None
        """Function that is called with the progress of the upload."""

    def ready(self, case: Mapping[str, Any], folder: Path) -> dict[str, Any]:
        """Returns a case as plain data with the hash of each file that the case names. On return the server has all
        these files. Relative paths are relative to ``folder``. Raises CaseError for unusable files, ClientError.
        """
        files = self._hashes.of(case, folder)
        for file in {file.sha256: file for file in files}.values():
            send(self._http, file, self.say)
        return with_hashes(case, files)

    def body(
        self, case: CaseSource, overrides: Overrides = (), folder: Path | str | None = None
    ) -> tuple[str, bytes, float]:
        """Returns content type and content of the request with a case, and the additional time for its answer, s,
        because the server reads the files of the case. A case without files is sent unchanged; the server reports
        its problems.
        """
        changes = list(overrides) if isinstance(overrides, Iterator) else overrides
        try:
            data = data_of(case, changes)
        except CaseError:
            data = {}
        if not files_of(data):
            return *body_of(case, changes), 0.0
        ready = self.ready(data, place_of(case, folder))
        return *(body_of(case, changes) if ready == data else ("application/json", to_json(ready))), SURVEY

    def sweep(
        self, case: CaseSource, points: Sequence[Point], folder: Path | str | None = None
    ) -> tuple[dict[str, Any], Sequence[Point], float]:
        """Returns the case and the points of a sweep with the hashes of their files, and the additional time for the
        answer, s. A point has a hash if it names another file than the case.
        """
        data = data_of(case)
        try:
            made = [apply_overrides(data, point) for point in points]
        except CaseError:
            return data, points, 0.0
        if not any(map(files_of, made)):
            return data, points, 0.0
        ready = [self.ready(each, place_of(case, folder)) for each in made]
        data = _with_those_of(data, ready)
        return (
            data,
            [_with_hashes(point, each, data) for point, each in zip(points, ready, strict=True)],
            SURVEY + _POINT * len(made),
        )


def place_of(case: CaseSource, folder: Path | str | None) -> Path:
    """Returns the folder to which paths are relative: ``folder`` if it is given, else the folder of the case file.
    Raises CaseError.
    """
    return folder_of(case) if folder is None else Path(folder)


def _with_those_of(data: dict[str, Any], ready: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Returns the case with the hashes of its files, without files that every point changes."""
    hashes = {(file.table, file.path): file.sha256 for each in ready for file in files_of(each)}
    known = {file.table: hashes[file.table, file.path] for file in files_of(data) if (file.table, file.path) in hashes}
    return apply_overrides(data, {f"{dotted(table)}.sha256": sha256 for table, sha256 in known.items()})


def _with_hashes(point: Point, ready: Mapping[str, Any], data: Mapping[str, Any]) -> Point:
    """Returns a point with the hashes of the files that the point itself names."""
    own = [file for file in files_of(ready) if file not in files_of(data)]
    return {**point, **{f"{dotted(file.table)}.sha256": file.sha256 for file in own}}
