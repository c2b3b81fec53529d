"""Contact, end time and time step of an LS-DYNA deck."""

from collections.abc import Callable

from conoid.cases.reading.cards import Block, Card

from ..account import Entry
from ..bonds import MOVED, Tie
from ..contacts import Meeting
from ..draft import Draft
from ..units import TIME
from .fields import Fields, trimmed
from .words import SWITCHES

SINGLE = frozenset({"CONTACT_AUTOMATIC_SINGLE_SURFACE", "CONTACT_ERODING_SINGLE_SURFACE", "CONTACT_AUTOMATIC_GENERAL",
                    "CONTACT_SINGLE_SURFACE"})  # fmt: skip
DOUBLE = frozenset({
    "CONTACT_AUTOMATIC_SURFACE_TO_SURFACE", "CONTACT_ERODING_SURFACE_TO_SURFACE", "CONTACT_SURFACE_TO_SURFACE",
    "CONTACT_AUTOMATIC_NODES_TO_SURFACE", "CONTACT_ERODING_NODES_TO_SURFACE", "CONTACT_NODES_TO_SURFACE",
    "CONTACT_AUTOMATIC_ONE_WAY_SURFACE_TO_SURFACE", "CONTACT_ONE_WAY_SURFACE_TO_SURFACE",
})  # fmt: skip
TIED = frozenset({"CONTACT_TIED_SURFACE_TO_SURFACE", "CONTACT_TIED_NODES_TO_SURFACE"})
OFFSETS = frozenset({"OFFSET", "CONSTRAINED", "BEAM"})
"""Words behind the name of a tied contact that keeps the distance between its surfaces."""
OPTIONS = frozenset({"ID", "TITLE", "MPP"})
_LAYOUT = (
    "SSID MSID SSTYP MSTYP SBOXID MBOXID SPR MPR", "FS FD DC VC VDC PENCHK BT DT", "SFS SFM SST MST SFST SFMT FSF VSF",
)  # fmt: skip
Surface = Callable[[int, int, Entry], frozenset[str]]
"""Function that returns the bodies of a surface. The arguments of the function are the number and the type of the
surface, and the keyword. The function raises ValueError."""


def contact(block: Block, name: str, options: frozenset[str], entry: Entry, surface: Surface) -> Meeting:
    """Reads a contact from its three cards. The bodies of a single surface are in contact with each other and with
    themselves. Raises ValueError.
    """
    fields = Fields(block, entry, _behind(block, options, entry), _LAYOUT)
    fields.forgive(
        "SPR MPR PENCHK VC VDC SFS SFM SST MST SFST SFMT VSF", "setting of the penalty method of LS-DYNA, or of output"
    )
    fields.refuse("SBOXID MBOXID", "boxes are not translated")
    fields.refuse("BT", "the contact begins after the start; in Conoid contact acts from the start")
    if 0.0 < fields.real("DT") < 1e19:
        fields.refuse("DT", "the contact ends before the run; in Conoid contact acts until the end")
    scale = fields.nonzero("FSF", 1.0)
    if scale != 1.0:
        fields.refuse("FSF", "friction is scaled")
    still, sliding, decay = fields.real("FS"), fields.real("FD"), fields.real("DC")
    if still < 0.0 or (decay and still != sliding):
        entry.remark("refused", f"FS = {still:g}, FD = {sliding:g}", "friction depends on the speed or on the part; "
            "in Conoid the friction is one number (FS with --anyway)")  # fmt: skip
    elif sliding != still and sliding:
        entry.remark("left", f"FD = {sliding:g}", "without DC the friction is FS at every speed")
    one = surface(fields.whole("SSID"), fields.whole("SSTYP"), entry)
    other = None if name in SINGLE else surface(fields.whole("MSID"), fields.whole("MSTYP"), entry)
    if name in SINGLE:
        fields.forgive("MSID MSTYP", "a contact of a single surface has no second surface")
    if fields.extra:
        entry.remark("left", f"line {fields.extra[0]}", "optional cards with settings of the penalty method")
        fields.extra.clear()
    fields.rest("refused")
    return Meeting(one, other, max(still, 0.0), entry)


def tied(block: Block, name: str, options: frozenset[str], entry: Entry, surface: Surface) -> list[Tie]:
    """Reads a tied contact. Raises ValueError."""
    found = contact(block, name, options - OFFSETS, entry, surface)
    fields = Fields(block, entry, _behind(block, options, None), _LAYOUT)
    thickness = [fields.real("SST"), fields.real("MST")]
    gap = 3.0 * sum(map(abs, thickness)) / 5.0 if min(thickness) < 0.0 else 0.0
    if gap:
        what = f"SST = {thickness[0]:g}, MST = {thickness[1]:g}"
        entry.remark("differs", what, "the largest distance of tied nodes, 0.6 (|SST| + |MST|), is bond.gap")
    if options & OFFSETS:
        entry.remark("differs", "OFFSET", MOVED)
    return [Tie(pair, entry, gap) for pair in sorted(found.pairs())]


def _behind(block: Block, options: frozenset[str], entry: Entry | None) -> list[Card]:
    """Returns the cards after the title and after the cards of the option MPP. The option MPP has one card, and a
    second card if the next card begins with ``&``.
    """
    cards = trimmed(block.cards)[bool(options & {"ID", "TITLE"}) :]
    if "MPP" not in options or not cards:
        return cards
    if entry is not None:
        entry.remark("left", f"line {cards[0].number}", "setting of the parallel contact search of LS-DYNA")
    return cards[1 + (len(cards) > 1 and cards[1].text.lstrip().startswith("&")) :]


def termination(block: Block, entry: Entry) -> float:
    """Reads the time at which the run ends, in units of the deck. Raises ValueError."""
    fields = Fields(block, entry, block.cards, ("ENDTIM ENDCYC DTMIN ENDENG ENDMAS NOSOL",))
    end = fields.real("ENDTIM")
    if end <= 0.0:
        raise ValueError(f"ENDTIM = {end:g} is not above 0")
    fields.refuse("NOSOL", "no solution is computed")
    fields.rest("left", "another condition that ends the run; in Conoid: run.max_steps, run.residual_limit")
    entry.take("run.end_time")
    return end


def time_step(draft: Draft, block: Block, entry: Entry) -> None:
    """Reads the factor of the time step, ``TSSFAC``, and records which fields are omitted."""
    layout = ("DTINIT TSSFAC ISDO TSLIMT DT2MS LCTM ERODE MS1ST",)
    fields = Fields(block, entry, block.cards, layout)
    safety = fields.real("TSSFAC")
    if 0.0 < safety <= 1.0:
        draft.numerics["dt_safety"] = safety
        fields.differ(
            "TSSFAC",
            "the factor scales Conoid's own stable step, which is shorter than a step from the smallest altitude",
        )
        entry.take("numerics.dt_safety")
    else:
        entry.leave("TSSFAC is not given; numerics.dt_safety is set to 0.9")
    fields.forgive("DT2MS", "Conoid does not scale masses to lengthen the time step")
    fields.forgive("DTINIT TSLIMT ISDO LCTM", "limits of the step")
    fields.forgive("ERODE MS1ST", "setting for elements with small time steps")
    fields.rest("left")


def switch(block: Block, entry: Entry) -> None:
    """Reads a keyword that has an effect only if one of its fields is not 0. Raises CardError."""
    layout, name, effect = SWITCHES[block.name]
    fields = Fields(block, entry, block.cards[:1], (layout,))
    if value := fields.real(name):
        entry.refuse(f"{name} = {value:g}: {effect}")
    else:
        entry.leave(f"no effect, because {name} is 0")


_ALE = frozenset({5, 6, 7, 11, 12})
"""Formulations of solids in which the material flows through the mesh (the manual, *SECTION_SOLID, ELFORM)."""


def section(block: Block, options: frozenset[str], entry: Entry) -> None:
    """Reads the formulation of solids. Raises CardError."""
    titled = "TITLE" in options
    for card in block.cards[titled :: 1 + titled]:
        form = block.whole(card, block.fields(card, *(10,) * 8)[1], "ELFORM") if card.text.strip() else 0
        if form in _ALE or "ALE" in options:
            entry.refuse(f"ELFORM = {form}: the material flows through the mesh (ALE); Conoid's mesh moves with it")
            return
    entry.leave("sets how elements are integrated; in Conoid all solids are tets: numerics.pressure")


def pictures(draft: Draft, block: Block, entry: Entry, end: float) -> None:
    """Reads the number of frames from ``*DATABASE_BINARY_D3PLOT``."""
    fields = Fields(block, entry, block.cards, ("DT LCDT BEAM NPLTC PSETID",))
    interval, count = fields.real("DT"), fields.whole("NPLTC")
    frames = draft.set_frames(count, interval, end, entry)
    if frames and not count and abs(frames * interval - end) > 1e-6 * end:
        fields.differ(
            "DT",
            f"{frames} frames, every {draft.quantity(end / frames, TIME)}: at equal intervals until the end of the run",
        )
    fields.rest("left")
