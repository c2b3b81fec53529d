"""Address of the server and token of the user. Address and token are taken from options, else from the environment,
else from the user's configuration file.
"""

import os
import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from conoid.cases.reading import whole
from conoid.cases.reading.problems import shown

from ..errors import ClientError, UsageError

DEFAULT_URL = "http://127.0.0.1:8750"
_SIGNS = re.compile(r"[!-\[\]-~]+")
"""Characters that an address may have: visible ASCII without the backslash, which some programs read as a slash."""


@dataclass(frozen=True)
class Target:
    """Address of a server and the token for this server; the token is None for a server without access control."""

    url: str
    token: str | None


def config_file() -> Path:
    """Path of the user's configuration file ``~/.config/conoid/client.toml``, or below XDG_CONFIG_HOME if it is set."""
    base = os.environ.get("XDG_CONFIG_HOME") or str(Path.home() / ".config")
    return Path(base) / "conoid" / "client.toml"


def target(url: str | None = None, token: str | None = None) -> Target:
    """Returns the server to use. A token of the configuration file is sent only to the server that the file names.
    Raises ClientError.
    """
    saved = read_config()
    chosen = address(url or os.environ.get("CONOID_URL") or saved.get("url") or DEFAULT_URL)
    shown = token or os.environ.get("CONOID_TOKEN")
    if not shown and chosen == saved.get("url", DEFAULT_URL).rstrip("/"):
        shown = saved.get("token")
    return Target(chosen, shown or None)


def address(url: str) -> str:
    """Returns the address of a server: scheme, host, optional port and path, without a slash at the end. Raises
    UsageError.
    """
    try:
        parts = urlsplit(url)
        fits = parts.port is None or parts.port > 0
    except ValueError:
        fits = False
    wanted = f"write the address with http:// or https://, such as {DEFAULT_URL}"
    if not (fits and parts.scheme in {"http", "https"} and parts.hostname and _SIGNS.fullmatch(url)):
        raise UsageError(f"url = {shown(url)}: {wanted}")
    if "@" in parts.netloc:
        raise UsageError(
            f"url: a user or password in the address is not sent; {wanted}, and give the token with --token"
        )
    if parts.query or parts.fragment or url.endswith(("?", "#")):
        raise UsageError(f"url = {shown(url)}: no ? or # may follow the address; {wanted}")
    return url.rstrip("/")


def read_config() -> dict[str, str]:
    """Returns the keys of the configuration file; empty if there is no file. Raises ClientError for an unusable
    file.
    """
    path = config_file()
    try:
        data = tomllib.loads(whole.read_text(path))
    except FileNotFoundError:
        return {}
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise ClientError(f"{path}: cannot be read: {error}") from None
    for key, value in data.items():
        if key not in {"url", "token"} or not isinstance(value, str):
            raise ClientError(f"{path}: {key} = {value!r}: allowed keys: url and token, each with a text as value")
    return data
