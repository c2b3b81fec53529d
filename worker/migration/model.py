"""Conversion of the model into a parcel, and of a parcel into the model."""

from typing import Any

import numpy as np

from conoid.cases.checks.on import ons
from conoid.cases.model.schema import MOST_PARTS, Case

from ..model.ids import located
from ..model.shares import Shares, ranks
from ..model.state import CHUNK, Bits, Block, Indices, Ints, Model, Nodes, Tets, force_table
from ..parallel.comm import Comm
from ..scene import domain
from .parcel import Parcel, Table, length, take
from .route import Arrived

_NODAL = ("id", "part", "x0", "x", "v", "mass", "force", "stepping", "group")
_OF_TETS = ("across", "bond", "weakest", "worn")
"""Columns of a block of tets that exist only if the scene needs them."""


def keep(model: Model, case: Case) -> Parcel:
    """Return a parcel with the nodes and tets of this rank."""
    nodes = model.nodes
    known = {
        "parts": model.parts, "elements_global": model.elements_global, "nodes_global": model.nodes_global,
        "part_starts": model.part_starts, "mean_volumes": model.mean_volumes, "size": model.size,
        "slack": model.slack, "rounding": model.rounding, "groups": model.groups, "scale": nodes.scale,
    }  # fmt: skip
    columns = {name: getattr(nodes, name) for name in (*_NODAL, *(["marks"] if ons(case) else []))}
    columns["force"] = nodes.force[:, :3]
    tets = {b.part: _keep_block(b, nodes.id) for b in model.blocks if b.n}
    return Parcel(known, {}, columns, tets, _keep_shares(nodes) if len(nodes.shares.rank) else {})


def _keep_shares(nodes: Nodes) -> dict[str, Table]:
    shares = nodes.shares
    of = nodes.id[shares.node]
    table = {"of": of, "key": of * MOST_PARTS + shares.part, "part": shares.part, "mass": shares.mass}
    return {"shares": table}


def _resume_shares(case: Case, parcel: Parcel, nodes: Nodes) -> Shares:
    rank = ranks(case)
    if not len(rank):
        return Shares()
    table = parcel.rows["shares"]
    return Shares(nodes.places(table["of"]), np.array(table["part"]), np.array(table["mass"]), rank)


def _keep_block(block: Block, ids: Ints) -> Table:
    state = block.state.transpose(0, 2, 1).reshape(-1, block.state.shape[1])[: block.n]
    some = {name: getattr(block, name) for name in _OF_TETS if len(getattr(block, name))}
    known = {"id": block.id, "corners": ids[block.tets], "group": block.group}
    return {**known, "state": state, "weight": np.tile([1.0, 0.0, 0.0], (block.n, 1)), **some}


def resume(case: Case, arrived: Arrived, comm: Comm) -> Model:
    """Return the model, made from the tables of a parcel. The tables must be sorted in the order of the tets and
    nodes.
    """
    parcel, known = arrived.parcel, arrived.parcel.known
    values: dict[str, Any] = {
        name: np.ascontiguousarray(parcel.nodes[name]) for name in (*_NODAL, "marks") if name in parcel.nodes
    }
    values["force"] = force_table(values["force"])
    nodes = Nodes(owner=arrived.owner, owned=arrived.owner == comm.rank, scale=known["scale"], **values)
    nodes.shares = _resume_shares(case, parcel, nodes)
    blocks = []
    for part in sorted(parcel.tets):
        if length(parcel.tets[part]):
            corners = located(nodes.id, parcel.tets[part]["corners"])
            border = arrived.border[corners].any(axis=1)
            order = np.lexsort((parcel.tets[part]["id"], ~border))
            parcel.tets[part] = take(parcel.tets[part], order)
            blocks.append(_resume_block(case, part, parcel.tets[part], corners[order], int(border.sum())))
    return Model(
        nodes, blocks, known["parts"], known["elements_global"], known["nodes_global"], known["part_starts"],
        known["mean_volumes"], known["size"], known["slack"], known["rounding"], known["groups"],
    )  # fmt: skip


def _resume_block(case: Case, part: int, table: Table, corners: Indices, border: int) -> Block:
    n, rows = table["state"].shape
    state = np.empty((-(-n // CHUNK) * CHUNK, rows))
    state[:n], state[n:] = table["state"], table["state"][-1]
    chunks = np.ascontiguousarray(state.reshape(-1, CHUNK, rows).transpose(0, 2, 1))
    across: Indices = table.get("across", np.zeros((0, 4), np.int32))
    tets: Tets = np.ascontiguousarray(corners, np.uint32)
    block = domain.block(case, part, table["id"], tets, chunks, across, border)
    block.group = table["group"]
    if "worn" in table:
        block.worn = table["worn"]
    if "bond" in table:
        bond: Bits = table["bond"]
        block.bond, block.weakest, block.hot = bond, table["weakest"], np.zeros(n, np.uint8)
    return block
