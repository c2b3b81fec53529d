"""Keywords of LS-DYNA that are omitted, with the reason; a keyword in no table refuses the import."""

LEFT: dict[str, str] = {
    "KEYWORD": "the format of the file",
    "END": "the end of the deck",
    "COMMENT": "a comment",
    "PARAMETER": "its values are inserted where the deck uses them",
    "INCLUDE": "the file is read as a part of the deck",
    "DATABASE": "output: a run writes frames, history.csv and probes",
    "HOURGLASS": "tets have no hourglass modes",
    "SECTION_SOLID": "how elements are integrated: all solids are tets with numerics.pressure",
    "CONTROL_ACCURACY": "how the other code computes",
    "CONTROL_BULK_VISCOSITY": "Conoid uses its own values (numerics.viscosity)",
    "CONTROL_CONTACT": "how the other code computes contact",
    "CONTROL_CPU": "a limit of wall time: run.max_wall_time",
    "CONTROL_ENERGY": "Conoid always writes all energies",
    "CONTROL_HOURGLASS": "tets have no hourglass modes",
    "CONTROL_MPP": "how the other code divides the work: run.ranks",
    "CONTROL_OUTPUT": "output",
    "CONTROL_PARALLEL": "how the other code divides the work: run.threads",
    "CONTROL_SHELL": "how shells are computed",
    "CONTROL_SOLID": "how the other code computes solids",
    "CONTROL_UNITS": "units are those of --units",
    "INTERFACE_SPRINGBACK": "output for another run",
    "DEFINE_BOX": "not used by any translated keyword",
    "DEFINE_COORDINATE": "not used by any translated keyword",
    "DEFINE_VECTOR": "not used by any translated keyword",
    "DEFINE_TABLE": "not used by any translated keyword",
}
"""Omitted keywords, identified by their first words."""

REFUSED: dict[str, str] = {
    "ELEMENT_SHELL": "shells: Conoid has solids only",
    "ELEMENT_TSHELL": "thick shells: Conoid has solids only",
    "ELEMENT_BEAM": "beams: Conoid has solids only",
    "ELEMENT_DISCRETE": "springs and dashpots: Conoid has none",
    "ELEMENT_MASS": "masses of nodes: Conoid has none",
    "ELEMENT_SEATBELT": "belts: Conoid has none",
    "ELEMENT_SPH": "particles: Conoid has tets only",
    "CONSTRAINED": "joins or holds nodes in a way that is not translated",
    "DAMPING": "damping of bodies: Conoid has none",
    "CONTROL_IMPLICIT": "an implicit analysis; Conoid is explicit",
    "CONTROL_THERMAL": "conduction of heat; Conoid computes none",
    "CONTROL_DYNAMIC_RELAXATION": "a state before the start, which a case does not have",
    "INITIAL_STRESS": "initial stresses; in Conoid bodies start without stress",
    "INITIAL_STRAIN": "initial strains; in Conoid bodies start without strain",
    "LOAD": "a load that is not translated",
    "BOUNDARY": "a boundary that is not translated",
    "INITIAL": "a state at the start that is not translated",
    "RIGIDWALL": "a finite rigid wall, or friction that depends on the direction: walls of a case are whole planes, "
    "cylinders and spheres; use a rigid part (parts[].rigid) of its shape instead",
    "CONSTRAINED_NODAL_RIGID_BODY": "a rigid body of nodes; parts[].rigid makes a whole part rigid",
    "CONSTRAINED_EXTRA_NODES": "nodes that move with a rigid body; [[bond]] ties deformable parts to each other",
    "CONSTRAINED_RIGID_BODIES": "merged rigid bodies; make one part of them",
    "CONSTRAINED_JOINT": "joints between rigid bodies: Conoid has none",
    "CONSTRAINED_TIED_NODES_FAILURE": "nodes that separate at a strain; [[bond]] has a strength and an energy",
    "CONSTRAINED_SPOTWELD": "welds of nodes; [[bond]] ties faces",
    "CONTACT": "a contact that is not translated",
    "SECTION": "no section of solids",
    "MAT": "Conoid has no such material law",
    "EOS": "Conoid has no such equation of state",
    "INCLUDE": "includes that move or change what they bring are not supported",
}
"""Keywords that change the answer, identified by their first words."""


def reason(name: str, table: dict[str, str]) -> str | None:
    """Returns the reason of the longest beginning of a keyword; a beginning ends between words."""
    words = name.split("_")
    for count in range(len(words), 0, -1):
        if found := table.get("_".join(words[:count])):
            return found
    return None
