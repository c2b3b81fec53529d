"""Options of Radioss that are omitted, with the reason, and options that refuse the import. An option in no table
also refuses the import.
"""

_OUTPUT = "request of output; a run writes frames, history.csv and probes"
_HOW = "setting of the other code's algorithms"
_USED = "not used by any translated keyword"

LEFT: dict[str, str] = {
    "ANALY": _HOW, "DEF_SOLID": _HOW, "DEF_SHELL": _HOW, "DEFAULT": _HOW, "IOFLAG": _OUTPUT, "RANDOM": _HOW,
    "ARCH": _HOW, "TH": _OUTPUT, "ACCEL": _OUTPUT, "GRNOD": _USED, "GRPART": _USED, "GRBRIC": _USED, "GRTETR": _USED,
    "SURF": _USED, "FUNCT": _USED, "SKEW": _USED, "FRAME": _USED, "BOX": _USED, "LINE": _USED, "SET": _USED,
    "TFILE": _OUTPUT, "PRINT": _OUTPUT, "ANIM": _OUTPUT, "H3D": _OUTPUT, "MON": _OUTPUT, "DYREL": _HOW,
    "OUTP": _OUTPUT, "PROC": _HOW, "TITLE": _OUTPUT,
    "END": "the end of the deck",
    "SPMD": "division of the work among processes; in Conoid: run.ranks",
    "PROP": "how elements are integrated",
    "SUBSET": "group of parts, which the solver does not use",
    "UNIT": "units of single options; options with their own units are refused",
    "AMS": "Conoid does not scale masses to lengthen the time step",
    "VERS": "the format of the file",
    "RFILE": "checkpoints: run.checkpoint_every",
    "STOP": "limits of errors: run.residual_limit",
    "DT": "limit of the time step; Conoid does not scale masses",
    "PARITH": "in Conoid the answer never depends on the number of ranks",
    "VER": "the format of the file",
}  # fmt: skip

REFUSED: dict[str, str] = {
    "SHELL": "shells: Conoid has solids only", "SH3N": "shells: Conoid has solids only",
    "BEAM": "beams: Conoid has solids only", "TRUSS": "trusses: Conoid has solids only",
    "SPRING": "springs: Conoid has none", "SPHCEL": "particles: Conoid has tets only",
    "QUAD": "plane elements: Conoid has solids only", "ADMAS": "masses at nodes: Conoid has no such masses",
    "RBODY": "a rigid body of nodes; parts[].rigid makes a whole part rigid", "RBE2": "joins nodes",
    "RBE3": "joins nodes", "RLINK": "joins nodes", "MPC": "joins nodes", "CYL_JOINT": "joins nodes",
    "INTER": "only TYPE7, TYPE24, TYPE25 and TYPE2 (tied) are translated",
    "RWALL": "a finite wall; walls of a case are infinite planes, cylinders and spheres: use a rigid part",
    "INIVEL": "only TRA and AXIS are translated", "IMPVEL": "only motions along x, y and z are translated",
    "MAT": "Conoid has no such material law", "EOS": "Conoid has no such equation of state",
    "FAIL": "Conoid has no such failure law", "CLOAD": "forces on nodes are not translated",
    "PLOAD": "pressure on surfaces is not translated; use [[boundaries]] kind = \"traction\"",
    "DAMP": "Conoid has no damping of bodies", "BCS": "this restraint is not translated",
}  # fmt: skip
"""Options that change the answer, with the reason for the refusal. A key of the table is the first word of an
option."""

SOLIDS = {"TETRA4": 4, "TETRA10": 10, "BRICK": 8, "PENTA6": 6, "BRIC20": 20}
"""Options that define solid elements, with the number of nodes of an element."""
