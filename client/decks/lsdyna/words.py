"""Keywords of LS-DYNA that are omitted, with the reason, and keywords that refuse the import. A keyword in no table
also refuses the import.
"""

LEFT: dict[str, str] = {
    "KEYWORD": "the format of the file",
    "END": "the end of the deck",
    "COMMENT": "a comment",
    "PARAMETER": "the values are inserted where the deck uses them",
    "INCLUDE": "the included file is read as a part of the deck",
    "CONTACT_FORCE_TRANSDUCER": "request of output; probes of contact_force_* measure the force on a part",
    "DATABASE": "request of output; a run writes frames, history.csv and probes",
    "HOURGLASS": "tets have no hourglass modes",
    "CONTROL_CHECK": "check of the mesh",
    "CONTROL_DEBUG": "output",
    "CONTROL_DISCRETE_ELEMENT": "setting of particles; elements of particles are refused",
    "CONTROL_ALE": "setting of ALE elements; sections of ALE elements are refused",
    "CONTROL_RIGID": "setting of the other code's rigid bodies",
    "CONTROL_REQUIRE_REVISION": "version of the other code",
    "CONTROL_SPH": "setting of particles; elements of particles are refused",
    "CONTROL_SPOTWELD_BEAM": "setting of beams; beams are refused",
    "CONTROL_STRUCTURED": "output",
    "CONTROL_SUBCYCLE": "setting of the other code's time steps",
    "CONTROL_ACCURACY": "setting of the other code's algorithms",
    "CONTROL_BULK_VISCOSITY": "Conoid uses its own values (numerics.viscosity)",
    "CONTROL_CONTACT": "setting of the other code's contact algorithm",
    "CONTROL_CPU": "limit of the wall time; in Conoid: run.max_wall_time",
    "CONTROL_ENERGY": "Conoid always writes all energies",
    "CONTROL_HOURGLASS": "tets have no hourglass modes",
    "CONTROL_MPP": "division of the work among processes; in Conoid: run.ranks",
    "CONTROL_OUTPUT": "output",
    "CONTROL_PARALLEL": "division of the work among threads; in Conoid: run.threads",
    "CONTROL_SHELL": "how shells are computed",
    "CONTROL_SOLID": "setting of the other code's solid elements",
    "CONTROL_UNITS": "the import takes the units from --units",
    "INTERFACE_SPRINGBACK": "output for another run",
    "DEFINE_BOX": "not used by any translated keyword",
    "DEFINE_COORDINATE": "not used by any translated keyword",
    "DEFINE_VECTOR": "not used by any translated keyword",
    "DEFINE_TABLE": "not used by any translated keyword",
}
"""Omitted keywords with the reason. A key of the table is the first words of a keyword."""

REFUSED: dict[str, str] = {
    "ELEMENT_SHELL": "shells: Conoid has solids only",
    "ELEMENT_TSHELL": "thick shells: Conoid has solids only",
    "ELEMENT_BEAM": "beams: Conoid has solids only",
    "ELEMENT_DISCRETE": "Conoid has no springs and dashpots",
    "ELEMENT_MASS": "masses at nodes: Conoid has no such masses",
    "ELEMENT_SEATBELT": "belts: Conoid has none",
    "ELEMENT_SPH": "particles: Conoid has tets only",
    "CONSTRAINED": "joins or holds nodes in a way that is not translated",
    "DAMPING": "Conoid has no damping of bodies",
    "INITIAL_STRESS": "initial stresses; in Conoid bodies start without stress",
    "INITIAL_STRAIN": "initial strains; in Conoid bodies start without strain",
    "LOAD": "this load is not translated",
    "LOAD_SEGMENT": 'a pressure on faces is not translated; write [[boundaries]] kind = "traction" with pressure, '
    "follows = true, and on = the set of the faces",
    "BOUNDARY": "this boundary condition is not translated",
    "INITIAL": "this initial condition is not translated",
    "RIGIDWALL": "a finite rigid wall, or friction that depends on the direction; walls of a case are infinite planes, "
    "cylinders and spheres: use a rigid part (parts[].rigid) of this shape instead",
    "CONSTRAINED_NODAL_RIGID_BODY": "a rigid body of nodes; parts[].rigid makes a whole part rigid",
    "CONSTRAINED_EXTRA_NODES": "nodes that move with a rigid body; [[bond]] ties deformable parts to each other",
    "CONSTRAINED_RIGID_BODIES": "merged rigid bodies; make one part of these bodies",
    "CONSTRAINED_JOINT": "Conoid has no joints between rigid bodies",
    "CONSTRAINED_TIED_NODES_FAILURE": "nodes that separate at a plastic strain; a [[bond]] has a strength and an "
    "energy instead",
    "CONSTRAINED_SPOTWELD": "welds of nodes; [[bond]] ties faces",
    "PART_INERTIA": "a body with given mass properties; parts[].rigid takes a mass, a centre and an inertia",
    "PART_MOVE": "parts that are moved before the start; write the moved nodes",
    "CONTACT": "this contact is not translated",
    "SECTION": "no section of solids",
    "MAT": "Conoid has no such material law",
    "EOS": "Conoid has no such equation of state",
    "INCLUDE": "includes that move or change the included nodes and elements are not supported",
}
"""Keywords that change the answer, with the reason for the refusal. A key of the table is the first words of a
keyword."""

SWITCHES: dict[str, tuple[str, str, str]] = {
    "CONTROL_DYNAMIC_RELAXATION": (
        "NRCYCK DRTOL DRFCTR DRTERM TSSFDR IRELAL EDTTL IDRFLG", "IDRFLG", "a relaxation before the start, which "
        "Conoid does not have",
    ),
    "CONTROL_IMPLICIT_GENERAL": ("IMFLAG", "IMFLAG", "an implicit analysis; Conoid is explicit"),
    "CONTROL_SOLUTION": ("SOLN", "SOLN", "a thermal analysis; Conoid computes no conduction of heat"),
}  # fmt: skip
"""Keywords that have an effect only if a field is not 0: the fields of the first card, this field, and the effect that
refuses the import."""
SWITCHED: dict[str, str] = {
    "CONTROL_IMPLICIT": "no effect without IMFLAG of *CONTROL_IMPLICIT_GENERAL",
    "CONTROL_THERMAL": "no effect without SOLN of *CONTROL_SOLUTION",
}
"""Keywords that have an effect only through a keyword of ``SWITCHES``."""


def reason(name: str, table: dict[str, str]) -> str | None:
    """Returns the reason for the longest key of ``table`` with which a keyword begins; the key must end at a word of
    the keyword.
    """
    words = name.split("_")
    for count in range(len(words), 0, -1):
        if found := table.get("_".join(words[:count])):
            return found
    return None
