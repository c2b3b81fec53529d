"""Libraries of the page: the server sends the tested files of an installed wheel, or reports in one line why the files
are missing.
"""

import gzip
import hashlib
import re
import sys
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from conoid.server.answers import page
from conoid.server.app import build_app, opened
from conoid.server.settings import Settings

WEB = Path(__file__).parents[2] / "client" / "web"


@pytest.fixture
def client(tmp_path: Path) -> Iterator[TestClient]:
    with served(tmp_path) as client:
        yield client


def served(folder: Path) -> TestClient:
    settings = Settings(runs=folder / "runs", zenoh_port=None, web=WEB)
    with opened(settings) as service:
        return TestClient(build_app(service), base_url="http://127.0.0.1")


def test_what_is_served_are_the_tested_files(client: TestClient) -> None:
    index = client.get("/lib/index.json").json()
    assert (index["auth"], index["problem"]) == (True, "")
    for address, (_, digest) in page.TESTED.items():
        answer = client.get(f"/lib/{page.VERSION}/{address}")
        assert hashlib.sha256(answer.content).hexdigest() == digest
        assert answer.headers["content-type"].startswith("text/javascript")
        assert "immutable" in answer.headers["cache-control"]
    assert client.get("/" + index["three"]).status_code == 200
    assert client.get("/" + index["echarts"]).status_code == 200
    assert client.get(f"/lib/{page.VERSION}/three/other.js").status_code == 404
    assert "nicegui" not in sys.modules


def test_a_browser_that_takes_gzip_gets_it(client: TestClient) -> None:
    library = page.libraries()["three/index.js"]
    assert gzip.decompress(library.zipped) == library.plain
    address = f"/lib/{page.VERSION}/three/index.js"
    plain = client.get(address, headers={"Accept-Encoding": "identity"})
    assert "content-encoding" not in plain.headers
    assert client.get(address).headers["content-encoding"] == "gzip"


def test_nothing_is_evaluated_and_nothing_comes_from_elsewhere(client: TestClient) -> None:
    policy = client.get("/").headers["content-security-policy"]
    scripts = next(part for part in policy.split(";") if part.strip().startswith("script-src"))
    assert scripts.split() == ["script-src", "'self'"]


def test_a_browser_asks_whether_the_page_is_still_the_same(client: TestClient) -> None:
    for address in ("/", "/app.js", "/style.css"):
        answer = client.get(address)
        assert (answer.status_code, answer.headers["cache-control"]) == (200, "no-cache"), address
        again = client.get(address, headers={"If-None-Match": answer.headers["etag"]})
        assert (again.status_code, again.headers["cache-control"]) == (304, "no-cache")


def test_files_named_by_the_page_never_change_and_all_scripts_are_among_them(client: TestClient) -> None:
    named = set(re.findall(r'(?:href|src)="(page/[^"]*)"', client.get("/").text))
    written = {path.name for path in WEB.iterdir() if path.suffix in {".js", ".css"}}
    assert {Path(address).name for address in named} == written
    assert len({Path(address).parent for address in named}) == 1
    for address in named:
        answer = client.get(f"/{address}")
        assert answer.text == (WEB / Path(address).name).read_text(encoding="utf-8")
        assert "immutable" in answer.headers["cache-control"], address
    assert client.get("/page/0000000000000000/app.js").status_code == 404


def test_the_page_does_not_take_unknown_addresses_for_its_own(client: TestClient) -> None:
    for method in ("POST", "DELETE"):
        assert client.request(method, "/v1/runz").status_code == 404
        refused = client.request(method, "/app.js")
        assert (refused.status_code, refused.headers["allow"]) == (405, "GET, HEAD")


@pytest.mark.parametrize(
    "address",
    ["app.js%00", "app.js%00.html", "%2e%2e/app.js", "..%2fapi.js", "app.js/", "app.js%2f", "%ff", "x" * 5000,
     "__init__.py", "lib/%00", f"lib/{page.VERSION}/three%00", f"lib/{page.VERSION}/%2e%2e/index.json"],
)  # fmt: skip
def test_an_odd_address_of_the_page_is_not_there(client: TestClient, address: str) -> None:
    for method in ("GET", "HEAD"):
        assert client.request(method, f"/{address}").status_code == 404


def test_a_route_exists_for_any_parameters(client: TestClient) -> None:
    """The route of the libraries also answers if the page answers all other addresses."""
    for method, path, allowed in (
        ("PUT", "/v1/runs", "GET, HEAD, POST"),
        ("DELETE", "/v1/me", "GET, HEAD"),
        ("GET", "/v1/cases:validate", "POST"),
    ):
        refused = client.request(method, path)
        assert (refused.status_code, refused.headers["allow"]) == (405, allowed), path


@pytest.mark.parametrize(
    ("version", "words"),
    [(None, "nicegui 3.18.0 is not installed"), ("3.17.0", "nicegui 3.17.0 is installed, tested is 3.18.0")],
)
def test_without_the_package_there_is_a_line_and_a_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, version: str | None, words: str
) -> None:
    replace_package(tmp_path, monkeypatch, version)
    client = served(tmp_path)
    index = client.get("/lib/index.json").json()
    assert index["problem"].startswith(words)
    assert "pip install --no-deps nicegui==3.18.0" in index["problem"]
    assert index["three"] is index["echarts"] is None
    assert client.get(f"/lib/{page.VERSION}/three/index.js").status_code == 404
    assert "<title>Conoid</title>" in client.get("/").text


def test_a_changed_file_is_not_served(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    replace_package(tmp_path, monkeypatch, page.VERSION)
    with pytest.raises(page.LibraryError, match="No such file"):
        page.libraries()
    for name, _ in page.TESTED.values():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("alert(1)")
    with pytest.raises(page.LibraryError, match="was tested"):
        page.libraries()


def replace_package(folder: Path, monkeypatch: pytest.MonkeyPatch, version: str | None) -> None:
    """Replaces the installed nicegui with an empty package of the version ``version``; with None, removes the
    package.
    """

    def distribution(name: str) -> metadata.Distribution:
        if version is None:
            raise metadata.PackageNotFoundError(name)
        info = folder / f"nicegui-{version}.dist-info"
        info.mkdir(exist_ok=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: nicegui\nVersion: {version}\n")
        return metadata.PathDistribution(info)

    monkeypatch.setattr(metadata, "distribution", distribution)
