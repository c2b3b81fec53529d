"""Submission of a run: the steps from a request body to an accepted run. The case is read, checked, estimated and
written to disk before the client gets its answer.
"""

import hashlib
import logging
import re
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import msgspec
from msgspec import structs
from sqlalchemy.exc import SQLAlchemyError

from conoid.cases.load import CaseError
from conoid.cases.site.batch import profile_of

from ..database.store import Store
from ..errors import ServiceError, database_away, invalid_case
from ..requests import limits
from ..runs import folder, restarts
from ..runs.folder import Copy, Submission
from ..runs.retries import words
from ..runs.supervisor import Supervisor
from ..settings import Settings
from . import copies
from .copies import Source, apart, of_owner, of_run
from .reader import the_reader
from .reading import Question, Reading, WrongCaseError
from .surveys import surveyed
from .uploads import Uploads

_log = logging.getLogger("conoid.server")
KINDS = {"application/toml": "case.toml", "application/json": "case.json"}
"""Content types of a case, and the names of the stored files."""
_LABEL = re.compile(r"([A-Za-z0-9._-]{1,63})=([^\x00-\x1f\x7f]{0,200})")
_MOST_LABELS = 16
"""Largest number of labels of a run (chosen value)."""
_KEY = re.compile(r"[\x21-\x7e]{1,255}")


@dataclass(frozen=True)
class Wishes:
    """Parameters of a submission, without the case."""

    labels: Mapping[str, str] = field(default_factory=dict)
    profile: str = ""
    """Profile of a batch system; empty: the profile in the case, or the default profile of the site."""
    priority: int = 0
    """Priority of the run among the runs of the same owner."""
    restart: str = ""
    """Id of a run of the same owner; the new run continues from its newest checkpoint."""

    @property
    def digest(self) -> str:
        """Hash of all parameters of the submission."""
        return hashlib.sha256(msgspec.json.encode(self, order="sorted")).hexdigest()


class Desk:
    """Accepts submissions. All methods of this class may be called from any thread."""

    def __init__(self, settings: Settings, store: Store, supervisor: Supervisor, sent: Uploads) -> None:
        """Creates the object. ``sent``: the uploaded files. A server has only one such object: its lock ensures that
        two requests with the same idempotency key make only one run.
        """
        self._settings, self._store, self._supervisor, self._sent = settings, store, supervisor, sent
        self._reader, self._limits = the_reader(), limits.of(settings)
        self._lock = threading.Lock()
        self.kept: Callable[[str], int] = lambda owner: 0
        """Function that returns the total size in bytes of the folders of an owner's runs."""

    def read(
        self, body: bytes, content_type: str, source: Source, surveys: dict[bytes, bytes] | None = None,
        *, swept: bool = False,
    ) -> Reading:  # fmt: skip
        """Reads the case in ``body``, and the files that the case names from ``source``. ``surveys``: surveys of mesh
        files that were made before, by the bodies that are made from the files; new surveys are added. ``swept``:
        whether the case is a point of a sweep. Without ``run.threads`` such a case gets one thread, because runs at the
        same time use the cores better than threads do. Raises CaseError with every problem of the case; raises
        ServiceError with status 415, 422 or 503.
        """
        kind = _file_name(content_type)
        most = structs.replace(self._limits, threads=1) if swept else self._limits
        question = Question(body=body, json=kind == "case.json", limits=most)
        reading = self._reader.read(question)
        if not reading.files:
            return reading
        try:
            with apart(self._settings.runs, reading.files, source) as place:
                survey = _surveyed(reading, place, {} if surveys is None else surveys)
                return self._reader.read(structs.replace(question, survey=survey, folder=str(place)))
        except CaseError as error:
            raise WrongCaseError(error.problems, reading.files) from None

    def source(self, owner: str, restart: str = "") -> Source:
        """Returns the source of the files that a case names: the uploaded files, or the files of the run that the new
        run continues.
        """
        return of_run(self._settings.runs / restart) if restart else of_owner(self._sent, owner)

    def submit(
        self, owner: str, body: bytes, content_type: str, key: str | None, wishes: Wishes | None = None,
        reading: Reading | None = None,
    ) -> dict[str, Any]:  # fmt: skip
        """Accepts a run and returns its receipt. The same idempotency key with the same body gives the same receipt.

        ``reading``: the case, if it has already been read. Raises ServiceError if the run is refused. The case and the
        first line of the journal are on disk when the method returns.
        """
        if key is not None and not _KEY.fullmatch(key):
            raise ServiceError(
                400, "bad_key", f"Idempotency-Key {key[:80]!r}: 1 to 255 visible ASCII characters",
                pointer="Idempotency-Key",
            )  # fmt: skip
        wishes = wishes or Wishes()
        asked = wishes.digest
        self._profile(wishes.profile, named=True)
        digest = folder.digest_of(_file_name(content_type), body)
        if earlier := self._earlier(owner, key, digest, wishes):
            return earlier
        try:
            reading = reading or self.read(
                body, content_type, self.source(owner, wishes.restart), swept="sweep" in wishes.labels
            )
        except CaseError as error:
            raise invalid_case(error.problems) from None
        with self._lock:
            return self._earlier(owner, key, digest, wishes) or self._accept(
                owner,
                body,
                content_type,
                key,
                digest,
                reading,
                replace(wishes, profile=self._profile(wishes.profile or reading.profile)),
                asked,
            )

    def check_room(self, owner: str, keys: Sequence[str]) -> None:
        """Raises ServiceError with status 422, 429 or 507 if the owner may not submit the runs for those ``keys`` for
        which no run exists yet.
        """
        more = sum(self._store.run_of_key(owner, key) is None for key in keys)
        if more:
            self._check_room(owner, more)

    def check_output(self, owner: str) -> None:
        """Raises ServiceError with status 429 if the folders of the owner's runs have reached their largest size."""
        limits.check_output(self.kept(owner), self._settings.site.quota)

    def _check_room(self, owner: str, more: int = 1) -> None:
        self.check_output(owner)
        limits.check_room(self._settings.runs, self._store.open_runs(owner), self._settings.caps, more)

    def runs_of(self, owner: str, keys: Sequence[str]) -> list[str]:
        """Returns the runs that were made with the given idempotency keys."""
        return [run_id for key in keys if (run_id := self._store.run_of_key(owner, key)) is not None]

    def take_back(self, run_id: str) -> None:
        """Cancels a run whose submission is refused; an error is only logged."""
        try:
            self._supervisor.cancel(run_id)
        except Exception as error:
            _log.error("the refused run %s was not cancelled: %s", run_id, words(error))

    def _profile(self, name: str, *, named: bool = False) -> str:
        """Returns the batch-system profile of the run; empty if the site has no batch system. ``named``: the profile in
        the request. Raises ServiceError with status 400 if the profile is unknown.
        """
        site = self._settings.site
        try:
            if site.launcher == "slurm" and site.slurm is not None:
                return profile_of(site.slurm, name)[0]
            if name and named:
                raise ValueError(f"profile = {name[:40]!r}: this server starts runs itself; there are no profiles")
        except ValueError as error:
            raise ServiceError(400, "bad_parameter", str(error), pointer="profile") from None
        return ""

    def _earlier(self, owner: str, key: str | None, digest: str, wishes: Wishes) -> dict[str, Any] | None:
        run_id = self._store.run_of_key(owner, key) if key is not None else None
        if run_id is None:
            return None
        try:
            made = folder.submission(self._settings.runs / run_id)
        except (*folder.DAMAGED, msgspec.MsgspecError):
            detail = f"the run of Idempotency-Key {key!r} was {run_id}; its folder has been removed or damaged"
            raise ServiceError(410, "gone", detail) from None
        if made.body_sha256 != digest or wishes.restart not in {"", made.labels.get(restarts.LABEL)}:
            detail = f"Idempotency-Key {key!r} was used for another case"
            raise ServiceError(422, "key_reused", detail, pointer="Idempotency-Key", hint="use a new key for a new run")
        if made.wishes_sha256 not in {"", wishes.digest}:
            detail = f"Idempotency-Key {key!r} was used with other labels, another profile or another priority"
            raise ServiceError(422, "key_reused", detail, pointer="Idempotency-Key", hint="use a new key for a new run")
        return receipt(made)

    def _accept(
        self, owner: str, body: bytes, content_type: str, key: str | None, digest: str, reading: Reading,
        wishes: Wishes, asked: str,
    ) -> dict[str, Any]:  # fmt: skip
        self._check_room(owner)
        run_id, now = folder.new_id()
        made = Submission(
            id=run_id, owner=owner, name=reading.name, title=reading.title, ranks=reading.ranks,
            threads=reading.threads, submitted=now,
            case_file=_file_name(content_type), body_sha256=digest, idempotency_key=key,
            wall_time=reading.wall_time, estimate=reading.estimate, labels=dict(wishes.labels),
            profile=wishes.profile, priority=wishes.priority, wishes_sha256=asked,
            files=[Copy(path=file.path, sha256=file.sha256) for file in reading.files],
        )  # fmt: skip
        run = folder.first(made)
        try:
            runs, source = self._settings.runs, self.source(owner, wishes.restart)

            def fill(beside: Path) -> None:
                copies.fill(reading.files, source, beside)
                if wishes.restart:
                    restarts.fill(runs / wishes.restart, beside)

            folder.create(runs, made, body, reading.resolved, fill)
            self._store.add(run, key, made.labels)
        except OSError as error:
            folder.discard(self._settings.runs, run_id)
            raise ServiceError(507, "storage", f"the run cannot be stored: {error.strerror}", retryable=True) from error
        except CaseError as error:
            folder.discard(self._settings.runs, run_id)
            raise invalid_case(error.problems) from None
        except ServiceError:
            folder.discard(self._settings.runs, run_id)
            raise
        except SQLAlchemyError as error:
            folder.discard(self._settings.runs, run_id)
            raise database_away(error) from error
        self._supervisor.admit(run)
        return receipt(made)


def _surveyed(reading: Reading, place: Path, known: dict[bytes, bytes]) -> bytes:
    """Returns the survey of the mesh files of a case. The survey is made once for all cases that make the same bodies
    from the files.
    """
    case = msgspec.json.decode(reading.case)
    bodies = msgspec.json.encode([(part["mesh"], part["turn"]) for part in case["parts"]])
    if bodies not in known:
        known[bodies] = surveyed(case, place)
    return known[bodies]


def labels_of(texts: Sequence[str]) -> dict[str, str]:
    """Returns the labels from texts ``NAME=VALUE``. Raises ServiceError with status 400 if a label is invalid."""
    found = [_LABEL.fullmatch(word) for word in texts]
    if None in found or len(texts) > _MOST_LABELS:
        wrong = next((word for word, read in zip(texts, found, strict=True) if read is None), f"{len(texts)} of them")
        hint = f"at most {_MOST_LABELS}: a name of letters, digits, '.', '_' or '-', '=', and up to 200 characters"
        raise ServiceError(400, "bad_parameter", f"label = {wrong[:80]!r}: not a label", pointer="label", hint=hint)
    pairs = [(read[1], read[2]) for read in found if read is not None]
    labels = dict(pairs)
    if len(labels) < len(pairs):
        name = next(name for n, (name, _) in enumerate(pairs) if name in dict(pairs[:n]))
        raise ServiceError(
            400, "bad_parameter", f"label = {name!r}: it has one value, and is given twice", pointer="label"
        )
    return labels


def receipt(made: Submission) -> dict[str, Any]:
    """Returns the answer to a submission; it is the same for a repeated request."""
    return {
        "id": made.id, "owner": made.owner, "name": made.name, "title": made.title, "state": "accepted",
        "ranks": made.ranks, "threads": made.threads, "submitted": made.submitted, "estimate": made.estimate,
        "files": [{"path": file.path, "sha256": file.sha256} for file in made.files],
        "url": f"/v1/runs/{made.id}",
    }  # fmt: skip


def _file_name(content_type: str) -> str:
    kind = content_type.partition(";")[0].strip().lower()
    if kind not in KINDS:
        raise ServiceError(
            415, "unsupported_type", f"Content-Type {kind[:80]!r}: a case is sent as {' or '.join(KINDS)}",
            pointer="Content-Type",
        )  # fmt: skip
    return KINDS[kind]
