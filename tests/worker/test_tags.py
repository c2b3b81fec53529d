"""Message tags come from one registry: no two tags are equal, and no tag is written as a number or a constant
elsewhere.
"""

import ast
from pathlib import Path

import pytest

import conoid.worker
from conoid.worker.parallel.tags import Tag

HOUSE = Path(str(conoid.worker.__file__)).parent
SOURCES = sorted(path for path in HOUSE.rglob("*.py") if path.name != "tags.py")
AT = {"send": 2, "Isend": 2, "Send_init": 2, "recv": 2, "Irecv": 2, "Recv_init": 2, "Improbe": 1}
"""Calls of mpi4py that take a tag, and the position of the argument ``tag``."""


def test_no_two_tags_are_equal() -> None:
    assert len(Tag.__members__) == len({tag.value for tag in Tag.__members__.values()})


def test_every_tag_has_a_meaning() -> None:
    tree = ast.parse((HOUSE / "parallel" / "tags.py").read_text(encoding="utf-8"))
    body = next(node for node in tree.body if isinstance(node, ast.ClassDef)).body
    pairs = [(one, after) for one, after in zip(body, [*body[1:], None], strict=True) if isinstance(one, ast.Assign)]
    assert len(pairs) == len(Tag)
    for one, after in pairs:
        assert isinstance(after, ast.Expr), ast.unparse(one)
        assert isinstance(after.value, ast.Constant), ast.unparse(one)


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.relative_to(HOUSE).as_posix())
def test_no_tag_is_made_elsewhere(path: Path) -> None:
    """mypy checks that every parameter ``tag`` has the type Tag; this test checks that no other code assigns a tag
    or removes its type."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Assign):
            names = [n.id for target in node.targets for n in ast.walk(target) if isinstance(n, ast.Name)]
            assert not [name for name in names if "TAG" in name], f"{path.name}:{node.lineno}: tags belong to tags.py"
        if isinstance(node, ast.arg) and node.arg == "tag":
            assert node.annotation is not None, f"{path.name}:{node.lineno}"
            assert ast.unparse(node.annotation) == "Tag", f"{path.name}:{node.lineno}: a tag is a Tag"


def test_mpi_is_given_tags_of_the_registry_only() -> None:
    """The calls of mpi4py have no types, so mypy cannot check their tags."""
    calls = set[str]()
    for node in ast.walk(ast.parse((HOUSE / "parallel" / "mpi.py").read_text(encoding="utf-8"))):
        if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in AT):
            continue
        named = {word.arg: word.value for word in node.keywords}
        given = [*node.args[AT[node.func.attr] :], *([named["tag"]] if "tag" in named else [])]
        assert len(given) == 1, f"line {node.lineno}: a message without a tag"
        assert ast.unparse(given[0]) in {"tag", *(f"Tag.{tag.name}" for tag in Tag)}, f"line {node.lineno}"
        calls.add(node.func.attr)
    assert calls == AT.keys()
