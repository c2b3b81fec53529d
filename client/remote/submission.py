"""A case in the form of the user: a file, the name of a shipped case, or plain data. The case is sent unchanged."""

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
    """Returns the file of a path or of the name of a shipped case. Raises CaseError."""
    if not str(source).strip():
        raise CaseError([Problem("case", "''", "the name is empty: write a .toml or .json file, or a shipped case")])
    path = Path(source)
    if str(source) in shipped():
        return shipped_path(str(source))
    if path.suffix in _SUFFIXES or path.exists():
        return path
    hint = nearest(str(source), shipped())
    raise CaseError([Problem("case", shown(str(source)), f"neither a .toml or .json file nor a shipped case; {hint}")])


def folder_of(source: CaseSource) -> Path:
    """Returns the folder of relative paths: the folder of the case file, for plain data the working folder. Raises
    CaseError.
    """
    return locate(source).parent if isinstance(source, str | Path) else Path()


def data_of(source: CaseSource, overrides: Overrides = ()) -> dict[str, Any]:
    """Returns the plain data of a case with its overrides, unchecked. Raises CaseError."""
    if isinstance(source, Case):
        data = source.model_dump(mode="json", exclude_unset=True)
    elif isinstance(source, Mapping):
        data = dict(source)
    elif not isinstance(source, str | Path):
        raise CaseError([Problem("case", shown(source), "a case is a file, the name of a shipped one, or plain data")])
    else:
        data = read_data(locate(source))
    return apply_overrides(data, overrides)


def case_of(source: CaseSource, overrides: Overrides = ()) -> Case:
    """Returns the checked case. Raises CaseError with every error."""
    return parse_case(data_of(source, overrides))


def body_of(source: CaseSource, overrides: Overrides = ()) -> tuple[str, bytes]:
    """Returns content type and body: a file unchanged, anything else as JSON. The server checks the case. Raises
    CaseError for a missing file, and for an impossible override.
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
    """Encodes plain data: NaN and infinity unchanged, which the server refuses with their key; numbers of numpy as
    numbers, types that JSON lacks as text.
    """
    return json.dumps(data, default=_plain).encode()


def _plain(value: Any) -> Any:
    return value.tolist() if hasattr(value, "tolist") else str(value)
