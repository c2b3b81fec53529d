"""Keywords of Abaqus that are omitted, with the reason, and keywords that change the answer. All known keywords
outside of these tables are translated.
"""

_OUTPUT = "request of output; a run writes frames, history.csv and probes"
_END = "the end of the part, instance, assembly or step"
_USED = "not used by any translated keyword"

LEFT: dict[str, str] = {
    "PREPRINT": _OUTPUT, "NODE OUTPUT": _OUTPUT, "ELEMENT OUTPUT": _OUTPUT, "CONTACT OUTPUT": _OUTPUT,
    "ENERGY OUTPUT": _OUTPUT, "INCREMENTATION OUTPUT": _OUTPUT, "INTEGRATED OUTPUT": _OUTPUT, "RESTART": _OUTPUT,
    "FILE OUTPUT": _OUTPUT, "NODE FILE": _OUTPUT, "EL FILE": _OUTPUT, "ENERGY FILE": _OUTPUT, "MONITOR": _OUTPUT,
    "DIAGNOSTICS": _OUTPUT, "FILTER": _OUTPUT, "NODE PRINT": _OUTPUT, "EL PRINT": _OUTPUT,
    "INTEGRATED OUTPUT SECTION": _OUTPUT, "TRACER PARTICLE": _OUTPUT,
    "END PART": _END, "END INSTANCE": _END, "END ASSEMBLY": _END, "END STEP": _END,
    "SECTION CONTROLS": "sets how elements are integrated and deleted; in Conoid: parts[].erosion",
    "HOURGLASS STIFFNESS": "tets have no hourglass modes",
    "BULK VISCOSITY": "Conoid uses its own values (numerics.viscosity)",
    "FIXED MASS SCALING": "Conoid does not scale masses to lengthen the time step",
    "VARIABLE MASS SCALING": "Conoid does not scale masses to lengthen the time step",
    "CONTACT CONTROLS": "setting of the other code's contact algorithm",
    "CONTACT CONTROLS ASSIGNMENT": "setting of the other code's contact algorithm",
    "CONTACT FORMULATION": "setting of the other code's contact algorithm",
    "CONTACT INITIALIZATION ASSIGNMENT": "treatment of bodies that overlap at the start; in Conoid: contact.overlap",
    "CONTACT INITIALIZATION DATA": "treatment of bodies that overlap at the start; in Conoid: contact.overlap",
    "SURFACE PROPERTY ASSIGNMENT": "thickness of shells; no effect on solids",
    "SURFACE BEHAVIOR": "contact in Conoid has no stiffness",
    "PHYSICAL CONSTANTS": "only the absolute zero of temperatures is read",
    "CONDUCTIVITY": "Conoid computes no conduction of heat",
    "DEPVAR": "belongs to a user subroutine",
    "ORIENTATION": _USED, "TRANSFORM": "directions of output; restraints in these directions are refused",
    "AMPLITUDE": _USED, "NSET": _USED, "ELSET": _USED, "SURFACE": _USED, "SURFACE INTERACTION": _USED,
    "FRICTION": _USED,
}  # fmt: skip

REFUSED: dict[str, str] = {
    "SHELL SECTION": "shells: Conoid has solids only", "MEMBRANE SECTION": "membranes: Conoid has solids only",
    "BEAM SECTION": "beams: Conoid has solids only", "COHESIVE SECTION": "cohesive elements: give [[bond]]",
    "CONNECTOR SECTION": "connectors: Conoid has none", "MASS": "masses at nodes: Conoid has no such masses",
    "ROTARY INERTIA": "masses at nodes: Conoid has no such masses", "SPRING": "springs: Conoid has none",
    "DASHPOT": "dashpots: Conoid has none", "COUPLING": "joins nodes in a way that is not translated",
    "KINEMATIC": "joins nodes in a way that is not translated", "MPC": "joins nodes in a way that is not translated",
    "EQUATION": "joins nodes in a way that is not translated",
    "EMBEDDED ELEMENT": "embedded bodies: Conoid has no such bodies",
    "RIGID BODY": "a rigid body that is not one whole section of solids",
    "CONTACT EXCLUSIONS": "pairs without contact; in Conoid all parts of contact.parts are in contact",
    "CLOAD": "forces on nodes are not translated; [[boundaries]] kind = \"traction\" acts on faces",
    "TEMPERATURE": "prescribed temperatures",
    "FIELD": "prescribed fields", "IMPORT": "imports the state of another analysis",
    "INCLUDE": "the keyword names no file with INPUT",
    "PARAMETER": "computed values; write numbers",
    **dict.fromkeys(
        ("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM", "IMPERFECTION"),
        "generates or moves nodes and elements, which is not supported; write the nodes and elements themselves",
    ),
    "STATIC": "another analysis than *DYNAMIC, EXPLICIT", "HEAT TRANSFER": "another analysis than *DYNAMIC, EXPLICIT",
    "FREQUENCY": "another analysis than *DYNAMIC, EXPLICIT", "ANNEAL": "another analysis than *DYNAMIC, EXPLICIT",
    "DAMPING": "Conoid has no damping of bodies",
}  # fmt: skip

MATERIAL = {
    "DENSITY", "ELASTIC", "PLASTIC", "RATE DEPENDENT", "DAMAGE INITIATION", "DAMAGE EVOLUTION", "SPECIFIC HEAT",
    "INELASTIC HEAT FRACTION", "EOS", "SHEAR FAILURE", "TENSILE FAILURE", "CONDUCTIVITY", "DEPVAR", "DAMPING",
}  # fmt: skip
"""Known keywords that are allowed below ``*MATERIAL``."""

READ = {
    "HEADING", "NODE", "ELEMENT", "NSET", "ELSET", "SURFACE", "PART", "ASSEMBLY", "INSTANCE", "SOLID SECTION",
    "MATERIAL", "AMPLITUDE", "INITIAL CONDITIONS", "BOUNDARY", "STEP", "DYNAMIC", "DLOAD", "CONTACT",
    "CONTACT INCLUSIONS", "CONTACT PROPERTY ASSIGNMENT", "CONTACT PAIR", "SURFACE INTERACTION", "FRICTION", "TIE",
    "OUTPUT", "PHYSICAL CONSTANTS", "RIGID BODY",
}  # fmt: skip

_SPELT = {"".join(each.split()): each for each in (*LEFT, *REFUSED, *MATERIAL, *READ)}


def spelt(word: str) -> str:
    """Returns a keyword in the spelling of the manual; the deck may have a shortened form: ``ENDPART`` is ``END
    PART``.
    """
    if word in _SPELT:
        return _SPELT[word]
    alike = [whole for joined, whole in _SPELT.items() if joined.startswith(word)] if word else []
    return alike[0] if len(alike) == 1 else word
