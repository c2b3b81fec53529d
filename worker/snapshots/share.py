"""Shares. A share is the data of a rank for a snapshot: a copy of the arrays from which fragments and their surface are
computed.

A share is written to a file that only the packer of the same run reads. The file has the names of the arrays in one
line, then the arrays.
"""

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from conoid.cases.reading.whole import named

from ..fracture.numbers import UNKNOWN
from ..model.ids import located
from ..model.rows import DAMAGE, MASS, PLASTIC_STRAIN, PRESSURE, S_XX, TEMPERATURE
from ..model.state import Block, Floats, Ints, Model, Nodes
from . import invariants

ROWS = {"plastic_strain": PLASTIC_STRAIN, "temperature": TEMPERATURE, "damage": DAMAGE}
"""Rows of the state of the tets from which fields are made. A block of tets may not have all of the rows."""
_STRESSES = PRESSURE + 1 - S_XX
_STRESS = slice(S_XX, PRESSURE + 1)
"""State rows of the deviatoric stress, and state row of the pressure."""
Share = dict[str, "np.ndarray"]
"""Dictionary of arrays. The names of the arrays of block k begin with ``k.``."""


def copied(
    model: Model, held: Ints, counting: set[int], numbers: Sequence[Ints] = (), known: Sequence[int] = (0, 0)
) -> Share:
    """Return the share of a rank.

    ``held`` (m, 2): ids of the tets of each cohesive facet; ``counting``: parts whose material law has damage;
    ``numbers``: fragment number of each tet in the last frame, one array for each block; ``known``: number of fragments
    at the start, and next free fragment number.
    """
    nodes = model.nodes
    share = {"nodes": nodes.id.copy(), "x": nodes.x.copy(), "v": nodes.v.copy(), "held": held.copy()}
    share |= {"numbers": np.array(known), **{f"{k}.fragment": each for k, each in enumerate(numbers)}}
    for k, block in enumerate(model.blocks):
        share[f"{k}.part"] = np.array([block.part])
        share[f"{k}.mass"] = block.row(MASS)
        share[f"{k}.stress"] = block.state[:, _STRESS, :].astype(np.float32)
        for name in ("id", "tets", "across", "bond"):
            share[f"{k}.{name}"] = getattr(block, name).copy()
        for name, row in ROWS.items():
            if block.has(row) and (row != DAMAGE or block.part in counting):
                share[f"{k}.{name}"] = block.row(row)
    return share


def write(path: Path, share: Share) -> None:
    """Write a share under a temporary name and rename the file. Raises OSError with the name of the file."""
    beside = path.with_name(path.name + ".part")
    try:
        with named(path), beside.open("wb") as file:
            file.write(json.dumps(list(share)).encode() + b"\n")
            for values in share.values():
                np.save(file, np.ascontiguousarray(values), allow_pickle=False)
        os.rename(beside, path)
    except OSError:
        beside.unlink(missing_ok=True)
        raise


def read(path: Path) -> Share:
    """Read a share. Raises OSError, ValueError."""
    with path.open("rb") as file:
        names = json.loads(file.readline())
        return {name: np.load(file, allow_pickle=False) for name in names}


@dataclass
class Whole:
    """The model of all ranks. Tets and nodes have the order of their global ids, so the model is equal for any number
    of ranks.
    """

    model: Model
    """Blocks of tets, one for each part. The restored blocks have ids, tets, faces and bonds only."""
    held: Ints
    """(m, 2) ids of the tets of each cohesive facet (``copied``)."""
    mass: Floats
    """(tets,) mass of each tet, kg, in the order of the blocks."""
    rank: "np.ndarray"
    """(tets,) uint16 rank of each tet."""
    rows: dict[str, Floats]
    """Dictionary of arrays (tets,): each state row of ``ROWS`` that at least one block has, with 0 in the other blocks;
    and the stress invariants."""
    numbers: Ints
    """(tets,) number of the fragment of each tet in the last frame."""
    initial: int
    """Number of fragments at the start; these fragments have the first numbers. The number is 0 if no part
    fractures."""
    next: int
    """Number that the next new fragment will get."""


def joined(shares: Sequence[Share], parts: list[str]) -> Whole:
    """Return the model, made from the shares of all ranks. The first share is that of rank 0. If a node is on several
    ranks, its state is read from the first of these ranks.
    """
    ids, first = np.unique(np.concatenate([share["nodes"] for share in shares]), return_index=True)
    x, v = (np.concatenate([share[name] for share in shares])[first] for name in ("x", "v"))
    n = len(ids)
    nodes = Nodes(
        ids, np.zeros(n, np.int32), np.zeros(n, np.int32), np.ones(n, bool), x, x, v, np.zeros(n),
        np.zeros((n, 3), np.int64), np.zeros(n),
    )  # fmt: skip
    gathered = [_block(shares, part, ids) for part in range(len(parts))]
    blocks = [block for block, _ in gathered if block.n]
    names = "mass", "rank", "fragment", "stress", *ROWS
    columns = {name: np.concatenate([column[name] for _, column in gathered]) for name in names}
    some = {name.partition(".")[2] for share in shares for name in share}
    held = np.concatenate([share["held"] for share in shares])
    total = sum(block.n for block in blocks)
    rows = {name: columns[name] for name in ROWS if name in some}
    if "stress" in some:
        rows |= invariants.of(columns["stress"].T)
    initial, following = shares[0]["numbers"].tolist()
    return Whole(
        Model(nodes, blocks, parts, total, n), held, columns["mass"], columns["rank"], rows,
        columns["fragment"].astype(np.int64), initial, following,
    )  # fmt: skip


def _block(shares: Sequence[Share], part: int, ids: Ints) -> tuple[Block, dict[str, "np.ndarray"]]:
    """Return the tets of a part and their columns. The tets are ordered by global id."""
    found = [
        (rank, {name.partition(".")[2]: share[name] for name in share if name.startswith(f"{k}.")}, share["nodes"])
        for rank, share in enumerate(shares)
        for k in range(_blocks(share))
        if share[f"{k}.part"][0] == part
    ]
    tet = np.concatenate([np.zeros(0, np.int64), *(block["id"] for _, block, _ in found)])
    order = np.argsort(tet)

    def column(name: str, empty: "np.ndarray", absent: float = 0.0) -> "np.ndarray":
        values = [block.get(name, np.full(len(block["id"]), absent)) for _, block, _ in found]
        joint = np.concatenate(values) if values else empty
        return joint[order] if len(joint) else joint

    nowhere = np.zeros((0, 4), np.int32)
    corners = [located(ids, nodes)[block["tets"]] for _, block, nodes in found]
    tets = (np.concatenate(corners)[order] if corners else nowhere).astype(np.uint32)
    columns = {name: column(name, np.zeros(0)) for name in ("mass", *ROWS)}
    stresses = [_by_tet(b["stress"], len(b["id"])) for _, b, _ in found if "stress" in b]
    columns["stress"] = np.concatenate(stresses)[order] if stresses else np.zeros((len(tet), _STRESSES), np.float32)
    columns["fragment"] = column("fragment", np.zeros(0, np.int64), UNKNOWN)
    ranks = np.concatenate([np.zeros(0, np.uint16), *(np.full(len(b["id"]), rank, np.uint16) for rank, b, _ in found)])
    bond = column("bond", nowhere.astype(np.uint8))
    made = Block(
        part, len(tet), tets, tet[order], np.zeros((0, 0, 0)), 0, 0, np.zeros(0),
        across=column("across", nowhere), bond=bond,
    )  # fmt: skip
    return made, {**columns, "rank": ranks[order]}


def _by_tet(stress: "np.ndarray", n: int) -> "np.ndarray":
    """Return (n, 7) rows, one for each tet, from an array (chunks, 7, CHUNK)."""
    return stress.transpose(0, 2, 1).reshape(-1, _STRESSES)[:n]


def _blocks(share: Share) -> int:
    return sum(name.endswith(".part") for name in share)
