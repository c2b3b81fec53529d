"""Options of Radioss that are omitted, with the reason; an option in no table refuses the import."""

_OUTPUT = "output: a run writes frames, history.csv and probes"
_HOW = "how the other code computes"
_USED = "not used by any translated keyword"

LEFT: dict[str, str] = {
    "ANALY": _HOW, "DEF_SOLID": _HOW, "DEF_SHELL": _HOW, "DEFAULT": _HOW, "IOFLAG": _OUTPUT, "RANDOM": _HOW,
    "ARCH": _HOW, "TH": _OUTPUT, "ACCEL": _OUTPUT, "GRNOD": _USED, "GRPART": _USED, "GRBRIC": _USED, "GRTETR": _USED,
    "SURF": _USED, "FUNCT": _USED, "SKEW": _USED, "FRAME": _USED, "BOX": _USED, "LINE": _USED, "SET": _USED,
    "TFILE": _OUTPUT, "PRINT": _OUTPUT, "ANIM": _OUTPUT, "H3D": _OUTPUT, "MON": _OUTPUT, "DYREL": _HOW,
    "OUTP": _OUTPUT, "PROC": _HOW, "TITLE": _OUTPUT,
    "END": "the end of the deck",
    "SPMD": "how the other code divides the work: run.ranks",
    "PROP": "how elements are integrated",
    "SUBSET": "groups of parts, not used by the solver",
    "UNIT": "units of single options; options with own units are refused",
    "AMS": "Conoid does not scale masses to lengthen the time step",
    "VERS": "the format of the file",
    "RFILE": "checkpoints: run.checkpoint_every",
    "STOP": "limits of errors: run.residual_limit",
    "DT": "limits of the time step; Conoid does not scale masses",
    "PARITH": "in Conoid the result never depends on the number of ranks",
    "VER": "the format of the file",
}  # fmt: skip

REFUSED: dict[str, str] = {
    "SHELL": "shells: Conoid has solids only", "SH3N": "shells: Conoid has solids only",
    "BEAM": "beams: Conoid has solids only", "TRUSS": "trusses: Conoid has solids only",
    "SPRING": "springs: Conoid has none", "SPHCEL": "particles: Conoid has tets only",
    "QUAD": "plane elements: Conoid has solids only", "ADMAS": "masses of nodes: Conoid has none",
    "RBODY": "a rigid body of nodes; parts[].rigid makes a whole part rigid", "RBE2": "joins nodes",
    "RBE3": "joins nodes", "RLINK": "joins nodes", "MPC": "joins nodes", "CYL_JOINT": "joins nodes",
    "INTER": "only TYPE7, TYPE24, TYPE25 and TYPE2 (tied) are translated",
    "RWALL": "a finite wall; walls of a case are whole planes, cylinders and spheres; use a rigid part",
    "INIVEL": "only TRA and AXIS are translated", "IMPVEL": "only motions along x, y and z are translated",
    "MAT": "Conoid has no such material law", "EOS": "Conoid has no such equation of state",
    "FAIL": "Conoid has no such law of failure", "CLOAD": "forces on nodes that are not translated",
    "PLOAD": "pressure on surfaces that is not translated: [[boundaries]] kind = \"traction\"",
    "DAMP": "damping of bodies: Conoid has none", "BCS": "a restraint that is not translated",
}  # fmt: skip
"""Options that change the answer, by their first word."""

SOLIDS = {"TETRA4": 4, "TETRA10": 10, "BRICK": 8, "PENTA6": 6, "BRIC20": 20}
"""Options that make elements with a volume, and their nodes."""
