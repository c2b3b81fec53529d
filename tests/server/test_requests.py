"""Messages of refused requests, and the access rights of users."""

import asyncio
import gzip
import json
import re
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest
from fastapi.routing import APIRoute
from starlette.requests import Request
from starlette.testclient import TestClient

from conoid.cases.load import shipped_path
from conoid.cases.reading.library import library
from conoid.cases.reference.json_schema import json_schema
from conoid.server.answers import reference
from conoid.server.answers.schemas import ALL
from conoid.server.app import ROUTERS, build_app, opened
from conoid.server.errors import ServiceError
from conoid.server.requests.connections import BODY
from conoid.server.requests.limits import read_body
from conoid.server.requests.tokens import check_token, create_token
from conoid.server.settings import Caps, Settings

from .running import TOML, Running, case_text

ROOT = Path(__file__).parents[2]
HEALTH = {"/healthz", "/readyz"}
OPEN = {*HEALTH, "/v1/case.schema.json"}
ROUTES = [
    (method, route.path)
    for router in ROUTERS
    for route in router.routes
    if isinstance(route, APIRoute) and route.path not in OPEN
    for method in sorted(route.methods or ())
]


def refusal(answer: Any, status: int, code: str) -> dict[str, Any]:
    """Returns the problem in an answer; the problem must have the form of RFC 9457."""
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    problem: dict[str, Any] = answer.json()
    assert (problem["status"], problem["code"], problem["type"]) == (status, code, f"urn:conoid:problem:{code}")
    assert problem["title"]
    assert "\n" not in problem["detail"]
    assert "Traceback" not in answer.text
    assert isinstance(problem["retryable"], bool)
    return problem


# Who asks -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("token", [None, "", "Bearer", "Bearer x", "Bearer conoid_0000000000_x", "Basic YTpi"])
def test_every_route_needs_a_token(server: Running, token: str | None) -> None:
    headers = {} if token is None else {"Authorization": token}
    for method, path in ROUTES:
        place = path.replace("{run_id}", "x").replace("{path:path}", "case.toml").replace("{rank}", "0")
        answer = server.nobody.http.request(method, place.replace("{name}", "demo"), headers=headers)
        assert answer.status_code == 401, f"{method} {path}"
        assert answer.headers["www-authenticate"] == "Bearer"
        if method != "HEAD":
            refusal(answer, 401, "unauthorized")


def test_the_list_of_routes_is_the_one_that_is_served(server: Running) -> None:
    paths = server.nobody.http.get("/openapi.json").json()["paths"]
    assert {path for _, path in ROUTES} | OPEN == {path.replace("{path}", "{path:path}") for path in paths}
    assert len(ROUTES) >= 15


@pytest.mark.parametrize("path", sorted(HEALTH))
def test_health_needs_none(server: Running, path: str) -> None:
    assert server.nobody.http.get(path).json()["status"] == "ok"
    assert server.nobody.http.head(path).status_code == 200


def test_another_users_run_is_not_there(server: Running) -> None:
    run = server.ann.submit()
    server.ann.wait_for(run)
    for method, path in ROUTES:
        if "{run_id}" in path:
            place = path.replace("{path:path}", "case.toml").replace("{rank}", "0")
            theirs = server.bob.http.request(method, place.replace("{run_id}", run))
            none = server.bob.http.request(method, place.replace("{run_id}", "0" * 22))
            assert theirs.status_code == none.status_code == 404
            if method != "HEAD":
                assert refusal(theirs, 404, "not_found")["detail"] == f"run {run!r}: there is none"
    assert server.bob.http.get("/v1/runs").json()["runs"] == []


def test_a_revoked_token_opens_nothing_after_a_second(server: Running) -> None:
    text = create_token(server.service.store, "ann", frozenset({"read"}))
    headers = {"Authorization": f"Bearer {text}"}
    assert server.nobody.http.get("/v1/runs", headers=headers).status_code == 200
    assert server.service.store.revoke(text.split("_")[1])
    deadline = time.monotonic() + 5.0
    while server.nobody.http.get("/v1/runs", headers=headers).status_code == 200:
        assert time.monotonic() < deadline
    assert server.nobody.http.get("/v1/runs", headers=headers).status_code == 401
    assert not server.service.store.revoke(text.split("_")[1])


def test_a_token_is_kept_as_a_hash_only(server: Running) -> None:
    text = create_token(server.service.store, "ann", frozenset({"read"}))
    secret = text.split("_", 2)[2]
    assert len(secret) >= 43, "256 bits"
    for path in server.service.settings.runs.glob("server.sqlite*"):
        assert secret.encode() not in path.read_bytes()
    found = check_token(server.service.store, text)
    assert found is not None
    assert found.owner == "ann"
    assert check_token(server.service.store, text[:-1]) is None


@pytest.mark.parametrize(
    ("scopes", "request_", "allowed"),
    [
        ("read", ("POST", "/v1/runs"), False),
        ("read", ("GET", "/v1/runs"), True),
        ("submit", ("GET", "/v1/runs"), False),
        ("read", ("GET", "/metrics"), False),
        ("metrics", ("GET", "/metrics"), True),
        ("metrics", ("GET", "/v1/me"), True),
        ("metrics", ("GET", "/v1/cases"), False),
    ],
)
def test_scopes(server: Running, scopes: str, request_: tuple[str, str], allowed: bool) -> None:
    token = create_token(server.service.store, "ann", frozenset(scopes.split()))
    answer = server.nobody.http.request(*request_, headers={"Authorization": f"Bearer {token}"})
    if allowed:
        assert answer.status_code == 200
    else:
        assert "scope" in refusal(answer, 403, "forbidden")["detail"]


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({}, 200),
        ({"Host": "localhost:8750"}, 200),
        ({"Host": "evil.example"}, 403),
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": "http://127.0.0.1"}, 200),
    ],
)
def test_without_tokens_pages_of_other_sites_are_kept_out(tmp_path: Path, headers: dict[str, str], status: int) -> None:
    settings = Settings(runs=tmp_path, auth=False, zenoh_port=None)
    with opened(settings) as service, TestClient(build_app(service), base_url="http://127.0.0.1") as client:
        assert client.get("/v1/me", headers=headers).status_code == status


# What is sent ---------------------------------------------------------------------------------------------------------


def test_a_body_of_two_mebibytes(server: Running) -> None:
    for content in (b"#" * (2 << 20), iter([b"#" * 65536] * 32)):
        problem = refusal(server.ann.http.post("/v1/runs", content=content, headers=TOML), 413, "too_large")
        assert str(BODY) in problem["detail"]
    refusal(server.nobody.http.post("/v1/runs", content=b"#" * (2 << 20), headers=TOML), 401, "unauthorized")


def test_the_largest_body_is_read(server: Running) -> None:
    text = case_text()
    body = text + "#" * (BODY - len(text))
    assert server.ann.http.post("/v1/cases:validate", content=body, headers=TOML).json()["valid"]


@pytest.mark.parametrize("kind", [None, "text/plain", "application/x-www-form-urlencoded", "multipart/form-data"])
@pytest.mark.parametrize("path", ["/v1/runs", "/v1/cases:validate"])
def test_a_wrong_content_type(server: Running, kind: str | None, path: str) -> None:
    headers = {} if kind is None else {"Content-Type": kind}
    problem = refusal(server.ann.http.post(path, content=case_text(), headers=headers), 415, "unsupported_type")
    assert "application/toml or application/json" in problem["detail"]


@pytest.mark.parametrize(
    ("text", "key", "words"),
    [
        (case_text().replace('"1 us"', '"1 mm"'), "run.end_time", "wrong dimension"),
        (case_text().replace('"1 us"', '"1 parsec"'), "run.end_time", "parsec"),
        (case_text().replace('"1 us"', "nan"), "run.end_time", ""),
        (case_text().replace("element_size", "element_sise"), "parts[0].mesh.element_sise", "element_size"),
        (case_text().replace('material = "steel"', 'material = "steal"'), "parts[0].material", "steel"),
        (case_text(ranks=3), "run.ranks", "2 slots"),
        (case_text(ranks=2, threads=2), "run.threads", "2 ranks x 2 threads take 4 slots, and this server has 2"),
        (case_text().replace('"0.5 mm"', '"1e-300 m"'), "parts[0].mesh.element_size", "not between"),
        ("name = = 3", "line 1", "TOML"),
    ],
)
def test_a_wrong_case_names_key_value_and_what_is_allowed(server: Running, text: str, key: str, words: str) -> None:
    problem = refusal(server.ann.http.post("/v1/runs", content=text, headers=TOML), 422, "invalid_case")
    entry = next(entry for entry in problem["errors"] if entry["key"] == key)
    assert words in entry["message"]
    assert problem["errors"][0]["key"] in problem["detail"]
    verdict = server.ann.http.post("/v1/cases:validate", content=text, headers=TOML).json()
    assert verdict == {"valid": False, "problems": problem["errors"], "files": []}
    assert server.ann.http.get("/v1/runs").json()["runs"] == []


def test_ranks_beyond_the_slots(server: Running) -> None:
    answer = server.ann.http.post("/v1/runs", content=case_text(ranks=64), headers=TOML)
    problem = refusal(answer, 422, "invalid_case")
    assert problem["errors"] == [
        {
            "key": "run.ranks",
            "value": "64",
            "message": "this server has 2 slots; allowed: 1 to 2",
            "pointer": "#/run/ranks",
        }
    ]
    assert problem["pointer"] == "#/run/ranks"


def test_all_problems_at_once(server: Running) -> None:
    text = case_text().replace('"1 us"', '"1 mm"').replace('"200 GPa"', '"200 kg"').replace("poisson", "poison")
    problem = refusal(server.ann.http.post("/v1/runs", content=text, headers=TOML), 422, "invalid_case")
    assert len(problem["errors"]) >= 3


@pytest.mark.parametrize("body", [b"{", b"[1]", b"\xff\xfe", b'{"name": 1e999}', b"[" * 100_000, b""])
def test_bad_json(server: Running, body: bytes) -> None:
    answer = server.ann.http.post("/v1/runs", content=body, headers={"Content-Type": "application/json"})
    refusal(answer, 422, "invalid_case")


def test_json_is_as_good_as_toml(server: Running) -> None:
    import tomllib

    body = json.dumps(tomllib.loads(case_text()))
    headers = {"Content-Type": "application/json; charset=utf-8"}
    answer = server.ann.http.post("/v1/runs", content=body, headers=headers)
    assert server.ann.wait_for(answer.json()["id"])["state"] == "succeeded"


def test_a_mesh_file_is_refused_before_anything_is_read(server: Running) -> None:
    text = case_text()
    head, tail = text.split("[parts.mesh]")[0], text.split('generator = "structured"')[1]
    text = f'{head}[parts.mesh]\nshape = "file"\npath = "/etc/passwd"\nunit = "1 mm"\n{tail}'
    problem = refusal(server.ann.http.post("/v1/runs", content=text, headers=TOML), 422, "invalid_case")
    assert [entry["key"] for entry in problem["errors"]] == ["parts[0].mesh.sha256"]
    assert "this key is missing: a server finds a file by its hash; conoid submit" in problem["detail"]


@pytest.mark.parametrize(
    ("caps", "key"),
    [
        (Caps(elements=1, free_disk=0), "parts"),
        (Caps(memory=1, free_disk=0), "parts"),
        (Caps(steps=1, free_disk=0), "run.end_time"),
        (Caps(core_seconds=1e-9, free_disk=0), "run.end_time"),
    ],
)
def test_caps_come_from_the_estimate(tmp_path: Path, caps: Caps, key: str) -> None:
    settings = Settings(runs=tmp_path, auth=False, zenoh_port=None, caps=caps)
    with opened(settings) as service, TestClient(build_app(service), base_url="http://127.0.0.1") as client:
        problem = refusal(client.post("/v1/runs", content=case_text(), headers=TOML), 422, "invalid_case")
        assert [entry["key"] for entry in problem["errors"]] == [key]
        assert "this server allows" in problem["detail"]


@pytest.mark.parametrize(
    ("caps", "status", "code"),
    [(Caps(queued=0, free_disk=0), 429, "queue_full"), (Caps(free_disk=1 << 60), 507, "disk_full")],
)
def test_no_room(tmp_path: Path, caps: Caps, status: int, code: str) -> None:
    settings = Settings(runs=tmp_path, auth=False, zenoh_port=None, caps=caps)
    with opened(settings) as service, TestClient(build_app(service), base_url="http://127.0.0.1") as client:
        assert refusal(client.post("/v1/runs", content=case_text(), headers=TOML), status, code)["retryable"]
        assert [path.name for path in tmp_path.iterdir() if path.is_dir()] == []


def test_wall_time_beyond_the_cap(tmp_path: Path) -> None:
    settings = Settings(runs=tmp_path, auth=False, zenoh_port=None, caps=Caps(wall_time=60, free_disk=0))
    text = case_text(extra='max_wall_time = "2 min"')
    with opened(settings) as service, TestClient(build_app(service), base_url="http://127.0.0.1") as client:
        problem = refusal(client.post("/v1/runs", content=text, headers=TOML), 422, "invalid_case")
        assert problem["errors"][0]["key"] == "run.max_wall_time"


# Idempotency ----------------------------------------------------------------------------------------------------------


def test_the_same_key_and_case_are_one_run(server: Running) -> None:
    headers = {**TOML, "Idempotency-Key": "k1"}
    first = server.ann.http.post("/v1/runs", content=case_text(), headers=headers)
    server.ann.wait_for(first.json()["id"])
    second = server.ann.http.post("/v1/runs", content=case_text(), headers=headers)
    assert (second.status_code, second.content) == (202, first.content)
    assert first.headers["location"] == second.headers["location"] == f"/v1/runs/{first.json()['id']}"
    assert len(server.ann.http.get("/v1/runs").json()["runs"]) == 1
    other = server.ann.http.post("/v1/runs", content=case_text(name="other"), headers=headers)
    assert refusal(other, 422, "key_reused")["pointer"] == "Idempotency-Key"
    theirs = server.bob.http.post("/v1/runs", content=case_text(), headers=headers)
    assert theirs.json()["id"] != first.json()["id"]


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ({"label": "a=1"}, {"label": "a=2"}),
        ({"label": "a=1"}, {}),
        ({}, {"label": "a=1"}),
        ({"priority": 1}, {"priority": 2}),
        ({}, {"priority": 2}),
    ],
)
def test_the_same_key_with_other_labels_or_priority_is_refused(
    server: Running, first: dict[str, Any], second: dict[str, Any]
) -> None:
    headers = {**TOML, "Idempotency-Key": "k1"}
    made = server.ann.http.post("/v1/runs", content=case_text(), headers=headers, params=first)
    again = server.ann.http.post("/v1/runs", content=case_text(), headers=headers, params=first)
    assert again.content == made.content
    other = server.ann.http.post("/v1/runs", content=case_text(), headers=headers, params=second)
    assert "other labels" in refusal(other, 422, "key_reused")["detail"]
    server.ann.wait_for(made.json()["id"])


def test_labels_in_another_order_are_the_same(server: Running) -> None:
    headers = {**TOML, "Idempotency-Key": "k1"}
    for labels in (["a=1", "b=2"], ["b=2", "a=1"]):
        made = server.ann.http.post("/v1/runs", content=case_text(), headers=headers, params={"label": labels})
        assert made.status_code == 202
    server.ann.wait_for(made.json()["id"])


@pytest.mark.parametrize("encoding", ["gzip", "br", "deflate", "zstd", "identity, gzip"])
def test_an_encoded_body_is_refused(server: Running, encoding: str) -> None:
    headers = {**TOML, "Content-Encoding": encoding}
    for path in ("/v1/runs", "/v1/cases:validate", "/v1/sweeps"):
        answer = server.ann.http.post(path, content=gzip.compress(case_text().encode()), headers=headers)
        assert encoding in refusal(answer, 415, "unsupported_encoding")["detail"]
        assert answer.headers["accept-encoding"] == "identity"
    plain = {**TOML, "Content-Encoding": "identity"}
    assert server.ann.http.post("/v1/cases:validate", content=case_text(), headers=plain).json()["valid"]


def test_the_same_key_at_the_same_time_is_one_run(server: Running) -> None:
    from concurrent.futures import ThreadPoolExecutor

    desk, body = server.service.desk, case_text().encode()
    with ThreadPoolExecutor(8) as pool:
        made = list(pool.map(lambda _: desk.submit("ann", body, "application/toml", "k"), range(16)))
    assert len({receipt["id"] for receipt in made}) == 1
    server.ann.wait_for(made[0]["id"])


@pytest.mark.parametrize("key", ["", "x" * 256, "two words"])
def test_a_bad_key(server: Running, key: str) -> None:
    answer = server.ann.http.post("/v1/runs", content=case_text(), headers={**TOML, "Idempotency-Key": key})
    refusal(answer, 400, "bad_key")


# Lists and the rest ---------------------------------------------------------------------------------------------------


def test_pages(server: Running) -> None:
    runs = [server.ann.submit() for _ in range(5)]
    for run in runs:
        server.ann.wait_for(run)
    seen, cursor = [], None
    while True:
        query = {"limit": 2, **({"cursor": cursor} if cursor else {})}
        page = server.ann.http.get("/v1/runs", params=query).json()
        seen += [run["id"] for run in page["runs"]]
        cursor = page["next"]
        if cursor is None:
            break
    assert seen == runs[::-1]
    assert server.ann.http.get("/v1/runs", params={"state": "failed,running"}).json()["runs"] == []
    assert len(server.ann.http.get("/v1/runs", params={"state": "succeeded"}).json()["runs"]) == 5


@pytest.mark.parametrize(
    ("path", "pointer"),
    [
        ("/v1/runs?limit=0", "limit"),
        ("/v1/runs?limit=x", "limit"),
        ("/v1/runs?state=done", "state"),
        ("/v1/runs?cursor=nonsense", "cursor"),
        ("/v1/runs?cursor=%C3%A4", "cursor"),
        ("/v1/runs?stat=failed", "stat"),
        ("/v1/cases?limit=1", "limit"),
    ],
)
def test_bad_parameters(server: Running, path: str, pointer: str) -> None:
    assert refusal(server.ann.http.get(path), 400, "bad_parameter")["pointer"] == pointer


def test_a_refusal_of_an_unknown_parameter_lists_the_known_ones(server: Running) -> None:
    """Without this check a wrongly spelt state would list all runs."""
    problem = refusal(server.ann.http.get("/v1/runs?stat=failed"), 400, "bad_parameter")
    allowed = "case, cursor, label, limit, prefix, since, state, text, until"
    assert problem["detail"] == f"stat: /v1/runs has no such parameter; allowed: {allowed}; did you mean 'state'?"


@pytest.mark.parametrize(
    ("method", "path", "status", "code"),
    [
        ("GET", "/v1/nothing", 404, "not_found"),
        ("GET", "/v1/runs/nothing", 404, "not_found"),
        ("GET", "/v1/cases/nothing", 404, "not_found"),
        ("POST", "/v1/runs/nothing:cancel", 404, "not_found"),
        ("DELETE", "/v1/runs", 405, "method_not_allowed"),
    ],
)
def test_a_missing_object_is_not_found(server: Running, method: str, path: str, status: int, code: str) -> None:
    refusal(server.ann.http.request(method, path), status, code)


def test_the_gallery(server: Running) -> None:
    cases = server.ann.http.get("/v1/cases").json()["cases"]
    assert "demo" in {case["name"] for case in cases}
    for case in cases:
        answer = server.ann.http.get(case["url"])
        assert answer.headers["content-type"].startswith("application/toml")
        assert f'name = "{case["name"]}"' in answer.text
    deck = server.ann.http.get("/v1/cases/imported_taylor/files/imported_taylor.inp")
    assert deck.content == shipped_path("imported_taylor").with_suffix(".inp").read_bytes()
    for file in ("imported_taylor.toml", "taylor_copper.toml", "..%2F..%2Fpyproject.toml"):
        assert server.ann.http.get(f"/v1/cases/imported_taylor/files/{file}").status_code == 404


def test_the_material_library(server: Running) -> None:
    listed = server.ann.http.get("/v1/materials").json()["materials"]
    assert [each["name"] for each in listed] == list(library())
    made = next(each for each in listed if each["name"] == "mild_steel_cowper_symonds")
    assert made["law"] == "cowper_symonds"
    rate = next(one for one in made["constants"] if one["key"] == "strength.D")
    assert (rate["value"], rate["confidence"]) == ("40.4 1/s", "memory")
    assert "Cowper and Symonds 1957" in rate["source"]


def test_validate_gives_the_estimate_and_every_default(server: Running) -> None:
    verdict = server.ann.http.post("/v1/cases:validate", content=case_text(), headers=TOML).json()
    assert verdict["valid"]
    assert verdict["estimate"]["elements"] > 0
    assert verdict["case"]["numerics"]["pressure"] == "nodal"
    assert server.ann.http.get("/v1/runs").json()["runs"] == []


def test_me(server: Running) -> None:
    me = server.ann.http.get("/v1/me").json()
    assert (me["owner"], me["zenoh"]) == ("ann", None)
    assert me["limits"]["ranks"] == me["slots"]["total"] == 2


def test_metrics(server: Running) -> None:
    server.ann.wait_for(server.ann.submit())
    text = server.ann.http.get("/metrics").text
    assert 'conoid_runs{state="succeeded"} 1' in text
    assert "conoid_slots 2" in text


def test_odd_methods_make_one_series(server: Running) -> None:
    for n in range(3):
        assert server.nobody.http.request(f"ODD{n}", "/v1/runs").status_code == 405
    text = server.ann.http.get("/metrics").text
    assert "ODD" not in text
    assert 'conoid_answers_total{method="other",route="/v1/runs",status="405"} 3' in text


def test_a_crash_is_counted(server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server.service.store, "page", lambda *_: 1 // 0)
    with pytest.raises(ZeroDivisionError):
        server.ann.http.get("/v1/runs")
    text = server.ann.http.get("/metrics").text
    assert 'conoid_answers_total{method="GET",route="/v1/runs",status="500"} 1' in text


def test_readiness_reports_a_dead_supervisor(server: Running) -> None:
    server.service.supervisor.close()
    answer = server.nobody.http.get("/readyz")
    assert (answer.status_code, answer.json()["checks"]["supervisor"]) == (503, False)


def test_a_crash_is_written_to_the_log_and_not_to_the_answer(
    server: Running, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError("a secret of the inside")

    monkeypatch.setattr(server.service.store, "page", fail)
    client = TestClient(build_app(server.service), raise_server_exceptions=False, headers=dict(server.ann.http.headers))
    answer = client.get("/v1/runs")
    assert "secret" not in answer.text
    refusal(answer, 500, "internal")
    assert "a secret of the inside" in caplog.text


def test_the_page(tmp_path: Path) -> None:
    web = tmp_path / "web"
    web.mkdir()
    (web / "index.html").write_text("<title>Conoid</title>")
    settings = Settings(runs=tmp_path / "runs", zenoh_port=None, web=web)
    with opened(settings) as service, TestClient(build_app(service), base_url="http://127.0.0.1") as client:
        page = client.get("/")
        assert page.text == "<title>Conoid</title>"
        assert "frame-ancestors 'none'" in page.headers["content-security-policy"]
        assert client.get("/../server.secret").status_code == 404
        refusal(client.get("/nothing.js"), 404, "not_found")
        refusal(client.get("/v1/runs"), 401, "unauthorized")


def test_openapi_has_the_schema_of_a_case(server: Running) -> None:
    document = server.ann.http.get("/openapi.json").json()
    schemas = document["components"]["schemas"]
    assert schemas["Case"]["properties"]["parts"]["items"] == {"$ref": "#/components/schemas/Part"}
    assert schemas["Part"]["properties"]["material"]["description"]
    for path in ("/v1/runs", "/v1/cases:validate"):
        content = document["paths"][path]["post"]["requestBody"]["content"]
        assert set(content) == {"application/toml", "application/json"}
        assert content["application/json"]["schema"] == {"$ref": "#/components/schemas/Case"}
    text = json.dumps(document)
    assert "#/$defs/" not in text
    for name in set(re.findall(r'"#/components/schemas/(\w+)"', text)):
        assert name in schemas
    _, ours = msgspec.json.schema_components(ALL)
    assert not ours.keys() & json_schema()["$defs"].keys(), "two shapes of one name"


@pytest.mark.parametrize(("path", "allowed"), [("/v1/runs", "GET, HEAD, POST"), ("/v1/runs/x:cancel", "POST")])
def test_a_wrong_method_gets_the_allowed_methods(server: Running, path: str, allowed: str) -> None:
    assert server.ann.http.put(path).headers["allow"] == allowed


def test_every_answer_of_openapi_has_a_shape(server: Running) -> None:
    paths = server.ann.http.get("/openapi.json").json()["paths"]
    for path, operations in paths.items():
        for method, operation in operations.items():
            secured = path not in OPEN
            assert bool(operation["security"]) == secured, path
            for status, answer in operation["responses"].items():
                kinds = answer.get("content", {})
                assert kinds or status in {"204", "304"}, f"{method} {path} {status}"
                if int(status) >= 400 and path != "/readyz":
                    assert "application/problem+json" in kinds, f"{method} {path} {status}"


def test_the_schema_that_a_shipped_case_names_is_served_beside_it(server: Running) -> None:
    first = server.ann.http.get("/v1/cases/demo").text.splitlines()[0]
    assert first == "#:schema ../case.schema.json"
    assert server.ann.http.get("/v1/cases/../case.schema.json").json() == json_schema()


def test_a_valid_case_gets_its_warnings(server: Running) -> None:
    text = case_text(end_time="1 us").replace('"1 us"', "1e-6")
    verdict = server.ann.http.post("/v1/cases:validate", content=text, headers=TOML).json()
    assert verdict["valid"]
    odd = {each["key"]: each["message"] for each in verdict["warnings"]}
    assert odd["run.end_time"] == "no unit, taken for 1e-06 s"


def test_the_key_of_a_removed_run_is_answered_as_in_openapi(server: Running) -> None:
    headers = {**TOML, "Idempotency-Key": "k"}
    run = server.ann.http.post("/v1/runs", content=case_text(), headers=headers).json()["id"]
    server.ann.wait_for(run)
    assert server.ann.http.delete(f"/v1/runs/{run}").status_code == 204
    refusal(server.ann.http.post("/v1/runs", content=case_text(), headers=headers), 410, "gone")
    paths = server.ann.http.get("/openapi.json").json()["paths"]
    for path in ("/v1/runs", "/v1/sweeps"):
        assert "410" in paths[path]["post"]["responses"], path


def test_an_etag_is_recognised_in_every_form(server: Running) -> None:
    """A proxy that compresses makes a tag weak; a browser may send several tags (RFC 9110, 13.1.2)."""
    run = server.ann.submit()
    server.ann.wait_for(run)
    for path in (f"/v1/runs/{run}", f"/v1/runs/{run}/files/case.toml", f"/v1/runs/{run}/snapshots"):
        tag = server.ann.http.get(path).headers["etag"]
        for form in (tag, f"W/{tag}", f'"other", W/{tag}'):
            assert server.ann.http.get(path, headers={"If-None-Match": form}).status_code == 304, (path, form)
        assert server.ann.http.get(path, headers={"If-None-Match": '"other"'}).status_code == 200


def test_a_body_that_breaks_off_is_no_fault_of_the_server() -> None:
    """In an earlier version the log had an error with two tracebacks."""
    body: Iterator[dict[str, Any]] = iter(
        [{"type": "http.request", "body": b"[run]", "more_body": True}, {"type": "http.disconnect"}]
    )

    async def receive() -> dict[str, Any]:
        return next(body)

    async def read() -> bytes:
        return await read_body(Request({"type": "http", "headers": [(b"content-length", b"100")]}, receive))

    with pytest.raises(ServiceError, match="the request body was interrupted") as raised:
        asyncio.run(read())
    assert raised.value.status == 400


# Addresses and parameters ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", ["/v1/runs/", "/v1/me/", "/healthz/", "/v1/sweeps/", "/readyz//"])
def test_no_answer_uses_an_address_of_the_request(server: Running, path: str) -> None:
    """In an earlier version the redirect for a trailing slash used the header Host."""
    answer = server.ann.http.get(path, headers={"Host": "evil.test"}, follow_redirects=False)
    assert answer.status_code == 404
    assert "evil.test" not in f"{answer.headers} {answer.text}"


@pytest.mark.parametrize(
    "query", ["limit=1&limit=2", "state=running&state=failed", "prefix=a&prefix=a", "cursor=&cursor="]
)
def test_a_parameter_of_one_value_is_given_once(server: Running, query: str) -> None:
    problem = refusal(server.ann.http.get(f"/v1/runs?{query}"), 400, "bad_parameter")
    assert "it has one value, and is given 2 times" in problem["detail"]
    assert problem["pointer"] == query.partition("=")[0]


def test_labels_may_be_several(server: Running) -> None:
    assert server.ann.http.get("/v1/runs?label=a=b&label=c=d").json()["runs"] == []


def test_the_log_of_a_run_that_has_ended_is_as_without_following(server: Running) -> None:
    run = server.ann.submit()
    server.ann.wait_for(run)
    while server.service.supervisor.is_open(run):
        time.sleep(0.01)
    log = server.ann.runs / run / "log" / "rank-0.log"
    log.write_text("a line\n")
    assert server.ann.http.get(f"/v1/runs/{run}/logs/0?follow=true").text == "a line\n"
    log.unlink()
    refusal(server.ann.http.get(f"/v1/runs/{run}/logs/0?follow=true"), 404, "not_found")


def test_the_page_of_the_http_interface_is_what_make_reference_makes() -> None:
    assert (ROOT / "docs" / "reference" / "http.md").read_text(encoding="utf-8") == reference.page(), (
        "run: make reference"
    )
