"""Bearer tokens of 256 random bits. A token is shown once, is stored as a hash, can be revoked, and has scopes."""

import hashlib
import hmac
import re
import secrets
import time

from ..database.store import Store, Token
from ..settings import StartError

SCOPES = {
    "read": "see own runs, their events and files, and subscribe over Zenoh",
    "submit": "validate, submit and cancel",
    "metrics": "read /metrics, which counts the runs of all users",
}
_PREFIX = "conoid"
_OWNER = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,62}")
_NOBODY = Token("", "", "0" * 64, frozenset(), 0.0)
"""Stored token of no user, with a hash of zeros that no secret has. A token that does not exist is compared with this
stored token, so that the comparison takes as long as for an existing token."""


class TokenError(StartError):
    """Error: a token cannot be made or revoked. The text of the error gives the reason."""

    exit_code = 2


def create_token(store: Store, owner: str, scopes: frozenset[str]) -> str:
    """Makes a token and returns its text, which cannot be read again later. Raises TokenError if the token cannot be
    made.
    """
    if not _OWNER.fullmatch(owner):
        raise TokenError(f"{owner!r}: a name starts with a letter or digit and has up to 63 letters, digits, _ or -")
    if unknown := scopes - SCOPES.keys():
        raise TokenError(f"unknown scope {', '.join(map(repr, sorted(unknown)))}; known: {', '.join(SCOPES)}")
    token_id, secret = secrets.token_hex(5), secrets.token_urlsafe(32)
    store.add_token(Token(token_id, owner, _hash(secret), scopes, time.time()))
    return f"{_PREFIX}_{token_id}_{secret}"


def check_token(store: Store, text: str) -> Token | None:
    """Returns the token of ``text``; None if ``text`` is not a valid token. Refusing a token takes the same time if its
    id does not exist as if its secret is wrong.
    """
    prefix, _, rest = text.partition("_")
    token_id, _, secret = rest.partition("_")
    token = store.token(token_id) if prefix == _PREFIX else None
    right = hmac.compare_digest((token or _NOBODY).sha256, _hash(secret))
    return token if right else None


def _hash(secret: str) -> str:
    """Returns the hash of a secret. A plain hash is safe because the secret has 256 random bits."""
    return hashlib.sha256(secret.encode()).hexdigest()
