"""The Zenoh router inside the server: workers publish messages to it, and clients subscribe there.

No other module of the server imports zenoh. Every token is a Zenoh user that may subscribe to the runs of its owner.
Every owner has a further Zenoh user, with which its workers publish. Zenoh reads users and rules only when it starts.
Therefore the router is closed and opened again when tokens change. Clients then reconnect automatically and read what
they have missed from the journal.
"""

import hashlib
import hmac
import json
import logging
import os
import secrets
import socket
import threading
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import zenoh

from conoid.cases.messages import Status, to_msgpack
from conoid.cases.output import keys
from conoid.cases.reading import whole
from conoid.cases.site.batch import Slurm

from . import durable
from .database.store import Token
from .launch import Access
from .requests.connections import raise_limit
from .settings import StartError, loopback

_log = logging.getLogger("conoid.server")
_SECRET, _USERS = "server.secret", ".zenoh-users"
_HANDSHAKE = 3000
"""Time in ms in which a new connection must authenticate; authentication takes two round trips (reason of the chosen
value)."""
_SECRET_BYTES, _SECRET_MOST = 32, 1 << 16
"""Smallest length of the secret in bytes, and largest number of bytes that are read from its file."""
_HEARS = ["put", "delete", "reply", "declare_queryable", "liveliness_token"]
_ASKS = ["declare_subscriber", "query", "liveliness_query", "declare_liveliness_subscriber"]
_ANSWERS = ["query", "declare_subscriber"]


class TelemetryError(StartError):
    """Error: the Zenoh router cannot be opened. The text of this error is one line."""


@dataclass(frozen=True)
class Reader:
    """Access data with which a client subscribes: endpoint, user name and password. ``user`` is empty for a router
    without access control.
    """

    port: int
    prefix: str
    user: str
    password: str


class Telemetry:
    """The Zenoh router of a server. All methods of this class may be called from any thread."""

    def __init__(
        self, runs: Path, host: str, port: int, tokens: Iterable[Token] | None, nodes: Slurm | None = None
    ) -> None:
        """Opens the Zenoh router. ``tokens``: None for a router without access control; ``nodes``: endpoints for the
        nodes of a cluster. If the disk is full, the server works without a router until ``follow`` can open it. Raises
        TelemetryError; raises OSError if the secret cannot be made.
        """
        self._runs, self._host, self._nodes = runs, host, nodes
        self.port = port or _free_port(host)
        self._secret = _read_secret(runs)
        self._places = raise_limit()
        """Largest number of sessions at the same time, and largest number of connections that have not
        authenticated."""
        self._lock = threading.Lock()
        self._tokens = None if tokens is None else frozenset((token.id, token.owner) for token in tokens)
        self._session: zenoh.Session | None = None
        try:
            self._session = self._open()
        except OSError as error:
            _log.error("the Zenoh router is opened later: %s: %s", error.filename, error.strerror)

    @property
    def local_endpoint(self) -> str:
        """Endpoint of the router for the workers on this machine."""
        host = self._host if loopback(self._host) else _local(self._host)
        return f"tcp/{_bracketed(host)}:{self.port}"

    def worker(self, owner: str, run: str) -> Access:
        """Returns the credentials of a worker."""
        prefix = keys.run_prefix(owner, run)
        if self._tokens is None:
            return Access(self.local_endpoint, prefix)
        user = _worker_user(owner)
        return Access(self.local_endpoint, prefix, user, self._password(user))

    def reader(self, owner: str, token: Token | None) -> Reader:
        """Returns the access data with which a client subscribes; they are valid when the method returns. Raises
        TelemetryError if the router cannot be opened.
        """
        prefix = keys.owner_prefix(owner)
        if self._tokens is None or token is None:
            return Reader(self.port, prefix, "", "")
        if (token.id, owner) not in self._tokens:
            self.admit({*self._tokens, (token.id, owner)})
        return Reader(self.port, prefix, token.id, self._password(token.id))

    def follow(self, tokens: Iterable[Token]) -> None:
        """Opens the router again if the tokens have changed."""
        if self._tokens is not None:
            self.admit({(token.id, token.owner) for token in tokens})

    def admit(self, tokens: Iterable[tuple[str, str]]) -> None:
        """Admits exactly the clients with the given tokens, as pairs (token id, owner). Raises TelemetryError if the
        router cannot be opened; the next call tries again.
        """
        with self._lock:
            wanted = frozenset(tokens)
            if wanted == self._tokens and self._session is not None:
                return
            self._close()
            self._tokens = wanted
            try:
                self._session = self._open()
            except OSError as error:
                raise TelemetryError(f"the Zenoh router cannot be opened: {error.filename}: {error.strerror}") from None

    def publish(self, owner: str, status: Status) -> None:
        """Publishes a message of the server about a run. The journal already has it, so that nothing is lost if a
        client misses it.
        """
        key = keys.message_key(keys.run_prefix(owner, status.run), status.channel)
        with self._lock:
            try:
                if self._session is not None:
                    self._session.put(key, to_msgpack(status), congestion_control=zenoh.CongestionControl.DROP)
            except zenoh.ZError as error:
                _log.warning("a message of run %s was not published: %s", status.run, error)

    def close(self) -> None:
        """Closes the Zenoh router."""
        with self._lock:
            self._close()

    def _close(self) -> None:
        if self._session is not None:
            self._session.close()  # type: ignore[no-untyped-call]
        self._session = None

    def _password(self, user: str) -> str:
        return hmac.new(self._secret, user.encode(), hashlib.sha256).hexdigest()

    def _open(self) -> zenoh.Session:
        """Opens a session of the Zenoh router. Raises TelemetryError; raises OSError if the file of users cannot be
        written.
        """
        users = self._runs / _USERS
        config = zenoh.Config()
        for key, value in self._config(users).items():
            config.insert_json5(key, json.dumps(value))
        try:
            return zenoh.open(config)
        except zenoh.ZError as error:
            raise TelemetryError(
                f"the Zenoh router cannot listen on port {self.port}: {_reason(error)}; --zenoh-port 0 takes a free one"
            ) from None
        finally:
            users.unlink(missing_ok=True)

    def _config(self, users: Path) -> dict[str, Any]:
        config: dict[str, Any] = {
            "mode": "router",
            "listen/endpoints": [f"tcp/{_bracketed(self._host)}:{self.port}"],
            "scouting/multicast/enabled": False,
            "scouting/delay": 0,
            "transport/shared_memory/enabled": False,
            "transport/unicast/accept_timeout": _HANDSHAKE,
            "transport/unicast/accept_pending": self._places,
            "transport/unicast/max_sessions": self._places,
        }
        if self._nodes is not None and self._nodes.listen:
            config["listen/endpoints"].append(self._nodes.listen)
            if self._nodes.certificate:
                config["transport/link/tls/listen_certificate"] = self._nodes.certificate
                config["transport/link/tls/listen_private_key"] = self._nodes.key
        if self._tokens is not None:
            owners = {owner for _, owner in self._tokens}
            names = [*(token for token, _ in self._tokens), *map(_worker_user, owners)]
            lines = "".join(f"{name}:{self._password(name)}\n" for name in names)
            durable.write(users, lines.encode(), mode=0o600)
            config["transport/auth/usrpwd"] = {
                "user": "server", "password": secrets.token_hex(), "dictionary_file": str(users),
            }  # fmt: skip
            config["access_control"] = access_rules(self._tokens)
        return config


def access_rules(tokens: Iterable[tuple[str, str]]) -> dict[str, Any]:
    """Returns the access rules of the router. The tokens of an owner may subscribe to the keys of the owner, and the
    user of the owner's workers may publish under these keys. Everything else is forbidden.
    """
    readers: dict[str, list[str]] = {}
    for token, owner in tokens:
        readers.setdefault(owner, []).append(token)
    rules, subjects, policies = [], [], []
    for owner, users in readers.items():
        below = keys.everything(keys.owner_prefix(owner))
        # The key pattern `**` does not match the `@adv` chunk, which carries the history of an advanced publisher.
        expressions = [below, f"{below}/@adv/**"]
        for name, flow, messages in (
            ("asks", "ingress", _ASKS),
            ("hears", "egress", _HEARS),
            ("tells", "ingress", _HEARS),
            ("answers", "egress", _ANSWERS),
        ):
            rules.append(
                {
                    "id": f"{owner} {name}", "permission": "allow", "flows": [flow], "messages": messages,
                    "key_exprs": expressions,
                }
            )  # fmt: skip
        subjects += [
            {"id": f"{owner} reads", "usernames": sorted(users)},
            {"id": f"{owner} works", "usernames": [_worker_user(owner)]},
        ]
        policies += [
            {"rules": [f"{owner} asks", f"{owner} hears"], "subjects": [f"{owner} reads"]},
            {"rules": [f"{owner} tells", f"{owner} answers"], "subjects": [f"{owner} works"]},
        ]
    return {
        "enabled": True, "default_permission": "deny", "rules": rules, "subjects": subjects, "policies": policies,
    }  # fmt: skip


def _worker_user(owner: str) -> str:
    return f"worker.{owner}"


def _read_secret(runs: Path) -> bytes:
    """Returns the secret from which all passwords are computed; it is made at the first start. Raises TelemetryError if
    its file is too short or if other users can read it; raises OSError if it cannot be made.
    """
    path = runs / _SECRET
    remedy = "remove it, and the server makes a new one; clients that watch a run request a new password automatically"
    if not os.path.lexists(path):
        durable.write(path, secrets.token_bytes(_SECRET_BYTES), mode=0o600)
    try:
        with whole.opened(path) as file:
            status, found = os.fstat(file.fileno()), file.read(_SECRET_MOST)
    except OSError as error:
        raise TelemetryError(f"{path}: {error.strerror}: {remedy}") from None
    if status.st_mode & 0o077:
        raise TelemetryError(f"{path}: has the mode {status.st_mode & 0o777:o}, allowed is 600: {remedy}")
    if len(found) < _SECRET_BYTES or len(set(found)) < _SECRET_BYTES // 4:
        raise TelemetryError(f"{path}: has {len(found)} bytes that can be guessed, at least {_SECRET_BYTES}: {remedy}")
    return found


def _free_port(host: str) -> int:
    with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET) as probe:
        probe.bind((host, 0))
        port: int = probe.getsockname()[1]
        return port


def _local(host: str) -> str:
    return {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host


def _reason(error: Exception) -> str:
    return "address already in use" if "in use" in str(error) else str(error).partition(" at /")[0]
