"""Writes .msh and .inp files with gmsh in random options: ``python gmsh_files.py FOLDER SEED COUNT``. The program runs
as a separate process, because gmsh has the licence GPL. The file ``truth.json`` contains the members of each group of
each written file, from the model of gmsh.
"""

import itertools
import json
import os
import random
import sys
from pathlib import Path
from typing import Any

import numpy as np


def main(folder: Path, seed: int, count: int) -> None:
    """Writes one model after the other, each in a separate process, because gmsh crashes on some models (SIGSEGV);
    crashed models are omitted.
    """
    import gmsh  # noqa: F401  once, for all

    truth: dict[str, dict[str, list[float]]] = {}
    for index in range(count):
        child = os.fork()
        if not child:
            _write(folder, seed, index)
            os._exit(0)
        _, status = os.waitpid(child, 0)
        if os.WIFSIGNALED(status):
            print(f"seed {seed}/{index}: gmsh has crashed")
        elif status:
            raise SystemExit(1)
        else:
            truth |= json.loads((folder / "one.json").read_text())
    if len(truth) < 0.95 * count:
        raise SystemExit(f"gmsh has crashed on {count - len(truth)} of {count} models")
    (folder / "truth.json").write_text(json.dumps(truth))


def _write(folder: Path, seed: int, index: int) -> None:
    """Writes one model, and the contents of the model into one.json."""
    import gmsh

    gmsh.initialize(readConfigFiles=False)
    gmsh.option.restoreDefaults()
    gmsh.option.setNumber("General.Terminal", 0)
    name, groups = _model(gmsh, random.Random(f"{seed}/{index}"), folder, index)
    (folder / "one.json").write_text(json.dumps({name: groups}))
    gmsh.finalize()


def _model(gmsh: Any, chance: random.Random, folder: Path, index: int) -> tuple[str, dict[str, list[float]]]:
    volumes = _bodies(gmsh, chance)
    groups = _groups(gmsh, chance, volumes)
    gmsh.option.setNumber("Mesh.MeshSizeMax", chance.choice((0.5, 0.7, 1.0)))
    flat = all(gmsh.model.getType(2, tag) == "Plane" for _, tag in gmsh.model.getEntities(2))
    if flat and chance.random() < 0.5:  # the volume of a face with four corners that is not flat is not defined
        gmsh.option.setNumber("Mesh.RecombineAll", 1)
    gmsh.model.mesh.generate(3)
    second = chance.random() < 0.07
    if second:
        gmsh.model.mesh.setOrder(2)
    options = {
        "MshFileVersion": chance.choice((2.2, 4.1)),
        "Binary": chance.randrange(2),
        "SaveAll": int(chance.random() < 0.25 or not groups),
        "SaveParametric": int(chance.random() < 0.25),
        "FirstNodeTag": chance.choice((1, 1, 1000)),
        "FirstElementTag": chance.choice((1, 1, 500)),
    }
    wedges = 13 in gmsh.model.mesh.getElementTypes(3) or 18 in gmsh.model.mesh.getElementTypes(3)
    inp = chance.random() < 0.12 and not wedges  # gmsh calls wedges of 15 nodes C3D6
    for name, value in options.items():
        gmsh.option.setNumber(f"Mesh.{name}", value)
    truth = _measured(gmsh, volumes, groups, options, inp)
    if not inp and chance.random() < 0.35:
        gmsh.option.setNumber("Mesh.PartitionCreateGhostCells", chance.randrange(2))
        gmsh.option.setNumber("Mesh.PartitionCreateTopology", chance.randrange(2))
        gmsh.model.mesh.partition(chance.randint(2, 3))
    gmsh.option.setNumber("Mesh.SaveGroupsOfElements", 1)
    file = f"g{index:03d}.{'inp' if inp else 'msh'}"
    gmsh.write(str(folder / file))
    if chance.random() < 0.15 and not (inp or second):
        truth = _renamed(chance, folder / file, truth, groups)
    return file, truth


def _bodies(gmsh: Any, chance: random.Random) -> list[int]:
    """Returns one to three bodies; bodies that touch or overlap get common faces."""
    occ = gmsh.model.occ
    for i in range(chance.randint(1, 3)):
        kind, x = chance.randrange(4), 1.2 * i
        if kind == 0:
            occ.addBox(x, 0, 0, 1.2, 1, chance.choice((1, 2)))
        elif kind == 1:
            occ.addSphere(x, 0, 0, 0.8)
        elif kind == 3 and i == 0:
            base = occ.addRectangle(x, 0, 0, 1.2, 1.1)
            occ.extrude([(2, base)], 0, 0, 1.5, numElements=[chance.randint(1, 3)], recombine=True)
            break
        else:
            occ.addCylinder(x, 0, 0, 0, 0, 1.5, 0.6)
    entities = occ.getEntities(3)
    if len(entities) > 1:
        occ.fragment(entities[:1], entities[1:])
    occ.synchronize()
    return [tag for _, tag in gmsh.model.getEntities(3)]


def _groups(gmsh: Any, chance: random.Random, volumes: list[int]) -> dict[str, list[int]]:
    """Returns physical groups of volumes, which may overlap or omit bodies, and one group of a surface."""
    found: dict[str, list[int]] = {}
    for i in range(chance.choice((0, 1, 2, 2, 3))):
        name = chance.choice(("steel", "Körper 1", "a b", "x")) + str(i) if chance.random() < 0.85 else ""
        members = chance.sample(volumes, chance.randint(1, len(volumes)))
        tag = gmsh.model.addPhysicalGroup(3, members, chance.choice((-1, 50 + i)), name=name)
        found[name or str(tag)] = members
    if chance.random() < 0.5:
        gmsh.model.addPhysicalGroup(2, [gmsh.model.getEntities(2)[0][1]], name=chance.choice(("steel0", "face")))
    return found


def _measured(
    gmsh: Any, volumes: list[int], groups: dict[str, list[int]], options: dict[str, Any], inp: bool
) -> dict[str, list[float]]:
    """Returns volume and first moments of each group; the empty name stands for the whole file."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(tags)
    points, tags = coordinates.reshape(-1, 3)[order], tags[order]

    def of(entities: list[int]) -> Any:
        total = np.zeros(4)
        for entity in entities:
            for kind in gmsh.model.mesh.getElementTypes(3, entity):
                if kind in (4, 11):
                    nodes = gmsh.model.mesh.getElementsByType(kind, entity)[1].reshape(-1, {4: 4, 11: 10}[kind])
                    x = points[np.searchsorted(tags, nodes[:, :4])]
                    each, centres = np.abs(np.linalg.det(x[:, 1:] - x[:, :1])) / 6.0, x.mean(axis=1)
                else:
                    local, weights = gmsh.model.mesh.getIntegrationPoints(kind, "Gauss4")
                    _, dets, at = gmsh.model.mesh.getJacobians(kind, local, entity)
                    each, centres = np.tile(weights, len(dets) // len(weights)) * dets, at.reshape(-1, 3)
                total += np.concatenate([[each.sum()], (each[:, None] * centres).sum(axis=0)])
        return total.tolist()

    saved = volumes if options["SaveAll"] else [v for v in volumes if any(v in members for members in groups.values())]
    truth = {"": of(saved)}
    if inp:  # gmsh writes blanks of names as _, and gives a group without a name a name
        groups = {name.replace(" ", "_"): members for name, members in groups.items() if not name.isdigit()}
    lost = not inp and options["SaveAll"] and options["MshFileVersion"] == 2.2  # gmsh omits the groups in this format
    if not truth[""][0]:
        return {}
    return truth if lost else truth | {name: of(members) for name, members in groups.items()}


def _renamed(
    chance: random.Random, file: Path, truth: dict[str, list[float]], groups: dict[str, list[int]]
) -> dict[str, list[float]]:
    """Gives two groups without a common body the name of the first of them."""
    names = [name for name in groups if not name.isdigit()]
    for one, other in itertools.combinations(names, 2):
        if other in truth and not set(groups[one]) & set(groups[other]):
            file.write_bytes(file.read_bytes().replace(f'"{other}"'.encode(), f'"{one}"'.encode()))
            both = (np.array(truth[one]) + np.array(truth[other])).tolist()
            return {name: value for name, value in truth.items() if name != other} | {one: both}
    return truth


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
