"""The index of runs and the tokens in a real PostgreSQL server, which the tests start; the tests are skipped without
PostgreSQL.
"""

import os
import pwd
import shutil
import subprocess
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from conoid.cases.run import State
from conoid.server.app import build_app, opened
from conoid.server.database.store import Store
from conoid.server.requests.tokens import create_token
from conoid.server.settings import Caps, Settings

from .running import FAKE, User

_ANSWERS = 60.0


def missing() -> str:
    """Returns the reason why no PostgreSQL server can be started on this machine; empty if PostgreSQL can be
    started.
    """
    if shutil.which("initdb") is None or shutil.which("postgres") is None:
        return "initdb, postgres: not installed (apt-get install postgresql, and its bin folder in PATH)"
    try:
        import psycopg  # noqa: F401
    except ImportError:
        return "psycopg: not installed"
    names = {entry.pw_name for entry in pwd.getpwall()}
    return "" if os.geteuid() != 0 or "postgres" in names else "root needs a user postgres to run it as"


pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(missing()), reason=missing() or "it is there")]


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    """URL of a database that is removed after the tests. The PostgreSQL server accepts connections only at a socket in
    its folder.
    """
    user = "postgres" if os.geteuid() == 0 else None
    with TemporaryDirectory(prefix="conoid-pg-") as place:
        if user is not None:
            shutil.chown(place, user)
        data = f"{place}/data"
        words = ["initdb", "-D", data, "-U", "conoid", "-A", "trust", "-E", "UTF8", "--no-sync"]
        subprocess.run(words, user=user, cwd=place, check=True, stdout=subprocess.DEVNULL, timeout=120)
        words = ["postgres", "-D", data, "-k", place, "-c", "listen_addresses=", "-c", "fsync=off"]
        server = subprocess.Popen(words, user=user, cwd=place, stderr=subprocess.DEVNULL)
        try:
            url = f"postgresql+psycopg://conoid@/postgres?host={place}"
            _await(url)
            yield url
        finally:
            server.terminate()
            server.wait(30)


def _await(url: str) -> None:
    engine, deadline = sa.create_engine(url), time.monotonic() + _ANSWERS
    while True:
        try:
            with engine.connect():
                break
        except sa.exc.OperationalError:
            assert time.monotonic() < deadline
            time.sleep(0.1)
    engine.dispose()


def test_a_run_lives_with_its_index_in_postgresql(url: str, tmp_path: Path) -> None:
    """A run is submitted and ends. The next server finds the ended run, also with an empty database."""
    settings = Settings(
        runs=tmp_path / "runs", port=0, zenoh_port=None, slots=2, worker=FAKE, grace=0.5, caps=Caps(free_disk=0),
        database=url,
    )  # fmt: skip
    with opened(settings) as service:
        token = create_token(service.store, "ann", frozenset({"read", "submit"}))
    runs: list[str] = []
    for database in (url, url, f"{url}&options=-csearch_path=empty"):
        if "empty" in database:
            _make_schema(url)
        with opened(replace(settings, database=database)) as service:
            if "empty" in database:
                token = create_token(service.store, "ann", frozenset({"read", "submit"}))
            http = TestClient(build_app(service), base_url="http://127.0.0.1")
            http.headers["Authorization"] = f"Bearer {token}"
            with http:
                ann = User(http, "ann", settings.runs)
                assert {run: ann.show(run)["state"] for run in runs} == dict.fromkeys(runs, "succeeded")
                runs.append(ann.submit())
                assert ann.wait_for(runs[-1])["state"] == "succeeded"
                found = http.get("/v1/runs", params={"state": "succeeded", "limit": 1}).json()
                assert found["runs"][0]["id"] == runs[-1]
                assert http.get("/v1/me").json()["used"]["queued"] == 0
                assert http.get("/readyz").status_code == 200


def _make_schema(url: str) -> None:
    engine = sa.create_engine(url)
    with engine.begin() as connection:
        connection.execute(sa.text("create schema empty"))
    engine.dispose()


def test_tokens_end_for_good(url: str) -> None:
    store = Store(url)
    token = create_token(store, "bob", frozenset({"read"}))
    known = next(one for one in store.tokens() if one.owner == "bob")
    assert token
    assert store.revoke(known.id)
    assert not store.revoke(known.id)
    assert store.token(known.id) is None
    assert set(store.count_by_state()) <= set(State)
    store.close()
