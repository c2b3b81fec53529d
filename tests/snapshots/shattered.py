"""A block that has shattered into random fragments, distributed over any number of ranks."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from conoid.worker.mesh.faces import across
from conoid.worker.snapshots.share import Share, Whole, joined

from ..worker.meshes import block

Floats = npt.NDArray[np.float64]
PARTS = ["one", "other"]


@dataclass
class Shattered:
    """The fragments have their own nodes and are a small distance apart; half of the tets are another part."""

    x: Floats
    v: Floats
    tets: "np.ndarray"
    part: "np.ndarray"
    mass: Floats
    across: "np.ndarray"
    bond: "np.ndarray"
    strain: Floats
    seeds: "np.ndarray"
    """Intended fragment of each tet, (tets,); an intended fragment may consist of several pieces."""

    def shares(self, ranks: int) -> list[Share]:
        """Returns the state of each of several ranks, with the tets distributed at random and in any order."""
        random = np.random.default_rng(ranks)
        owner = random.integers(0, ranks, len(self.tets))
        owner[random.permutation(len(self.tets))[:ranks]] = np.arange(ranks)
        return [self._share(np.flatnonzero(owner == rank), random) for rank in range(ranks)]

    def whole(self, ranks: int) -> Whole:
        """Returns the state of all ranks combined."""
        return joined(self.shares(ranks), PARTS)

    def _share(self, mine: "np.ndarray", random: np.random.Generator) -> Share:
        ids = np.unique(self.tets[mine])
        share = {"nodes": ids, "x": self.x[ids], "v": self.v[ids], "held": np.zeros((0, 2), np.int64)}
        share["numbers"] = np.array([1, 0])  # fragments are recorded, but no record exists yet
        for k, part in enumerate(np.unique(self.part[mine])):
            some = random.permutation(mine[self.part[mine] == part])
            share |= {
                f"{k}.part": np.array([part]), f"{k}.mass": self.mass[some], f"{k}.id": some,
                f"{k}.tets": np.searchsorted(ids, self.tets[some]).astype(np.uint32),
                f"{k}.across": self.across[some], f"{k}.bond": self.bond[some],
            }  # fmt: skip
            if part:
                share[f"{k}.plastic_strain"] = self.strain[some]
        return share


def shattered(cells: int, fragments: int, seed: int = 1) -> Shattered:
    """Returns a cube of six times ``cells``^3 tets in about the given number of fragments."""
    random = np.random.default_rng(seed)
    mesh = block((cells, cells, cells), size=1e-3)
    centres = mesh.points[mesh.tets].mean(axis=1)
    part = (centres[:, 0] > 0.5e-3 * cells).astype(np.int64)
    order = np.argsort(part, kind="stable")
    tets, centres, part = mesh.tets[order].astype(np.int64), centres[order], part[order]
    places = random.uniform(0.0, 1e-3 * cells, (fragments, 3))
    seeds = np.array([np.argmin(((places - centre) ** 2).sum(axis=1)) for centre in centres])
    body = 2 * seeds + part
    pairs, corners = np.unique(body[:, None] * len(mesh.points) + tets, return_inverse=True)
    of, node = np.divmod(pairs, len(mesh.points))
    behind = across(tets.astype(np.int32))
    other = np.where(behind >= 0, body[behind // 4], -1)
    apart = (behind >= 0) & (part[behind // 4] != part[:, None])
    behind[apart] = -1
    bond = ((behind >= 0) & (other != body[:, None])).astype(np.uint8)
    way = random.normal(size=(2 * fragments, 3))
    return Shattered(
        mesh.points[node] + 1e-4 * way[of], 100.0 * way[of] + random.normal(size=(len(of), 3)), corners.reshape(-1, 4),
        part, random.uniform(1e-6, 2e-6, len(tets)), behind, bond, random.uniform(0.0, 0.3, len(tets)), body,
    )  # fmt: skip
