"""A case in the form in which the user gives it: a file, the name of a shipped case, or plain data. The case is sent
unchanged.
"""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from conoid.cases.load import CaseError, Overrides, apply_overrides, parse_case, read_data, shipped, shipped_path
from conoid.cases.model.schema import Case
from conoid.cases.reading.problems import Problem, shown
from conoid.cases.reading.similar import nearest

CaseSource = str | Path | Mapping[str, Any] | Case
_SUFFIXES = {".toml": "application/toml", ".json": "application/json"}


def locate(source: str | Path) -> Path:
    """Returns the path of a case file; ``source`` is a path or the name of a shipped case. Raises CaseError."""
    if not str(source).strip():
        raise CaseError(
            [Problem("case", "''", "the name is empty: write a .toml or .json file, or the name of a shipped case")]
        )
    path = Path(source)
    if str(source) in shipped():
        return shipped_path(str(source))
    if path.suffix in _SUFFIXES or path.exists():
        return path
    hint = nearest(str(source), shipped())
    raise CaseError(
        [Problem("case", shown(str(source)), f"this is neither a .toml or .json file nor a shipped case; {hint}")]
    )


def folder_of(source: CaseSource) -> Path:
    """Returns the folder to which paths of a case are relative: the folder of the case file, or the working folder
    for plain data. Raises CaseError.
    """
    return locate(source).parent if isinstance(source, str | Path) else Path()


def data_of(source: CaseSource, overrides: Overrides = ()) -> dict[str, Any]:
    """Returns a case as plain data with its overrides, without a check. Raises CaseError."""
    if isinstance(source, Case):
        data = source.model_dump(mode="json", exclude_unset=True)
    elif isinstance(source, Mapping):
        data = dict(source)
    elif not isinstance(source, str | Path):
        raise CaseError(
            [Problem("case", shown(source), "a case must be a file, the name of a shipped case, or plain data")]
        )
    else:
        data = read_data(locate(source))
    return apply_overrides(data, overrides)


def case_of(source: CaseSource, overrides: Overrides = ()) -> Case:
    """Returns a case after its check. Raises CaseError with every error."""
    return parse_case(data_of(source, overrides))


def body_of(source: CaseSource, overrides: Overrides = ()) -> tuple[str, bytes]:
    """Returns the content type and the content of the request with a case. A file is sent unchanged, plain data as
    JSON; the server checks the case. Raises CaseError for a missing file and for an impossible override.
    """
    changes = list(overrides) if isinstance(overrides, Iterator) else overrides
    if isinstance(source, str | Path) and not changes:
        path = locate(source)
        try:
            return _SUFFIXES[path.suffix], path.read_bytes()
        except (OSError, KeyError):
            read_data(path)
    return "application/json", to_json(data_of(source, changes))


def to_json(data: Mapping[str, Any]) -> bytes:
    """Encodes plain data as JSON. NaN and infinity stay, because the server refuses them with their key. Numbers of
    numpy become numbers, types that JSON lacks become text.
    """
    return json.dumps(data, default=_plain).encode()


def _plain(value: Any) -> Any:
    return value.tolist() if hasattr(value, "tolist") else str(value)
