"""Fields that pictures can show: arrays in a frame, units and colours."""

from dataclasses import dataclass

from conoid.cases.reading.similar import allowed

from ..errors import LookError

_VIRIDIS = "#355f8d", "#2a788e", "#21918c", "#22a884", "#44bf70", "#7ad151", "#bddf26", "#fde725"
_CIVIDIS = "#3b496c", "#575d6d", "#707173", "#8a8779", "#a59c74", "#c3b369", "#e1cc55", "#fee838"
_PLASMA = "#5302a3", "#8b0aa5", "#b83289", "#db5c68", "#f48849", "#febd2a", "#f0f921"
"""Perceptually uniform colour scales (van der Walt and Smith 2015, CC0; cividis: Nunez, Anderton and Renslow 2018).
The darkest part of each scale is left out, because the shape of a body is not visible in dark colours."""
_STRAINED = "#d9dfe6", "#f7d889", "#f49a3d", "#d4432c", "#7c0f34"
_TWO_SIDED = (
    "#053061", "#2166ac", "#4393c3", "#92c5de", "#d1e5f0", "#f7f7f7", "#fddbc7", "#f4a582", "#d6604d", "#b2182b",
    "#67001f",
)  # fmt: skip
"""Colour scale RdBu (ColorBrewer, Harrower and Brewer 2003); negative values are blue."""
NAMED = ("classes", "fragments")
"""Kinds of fields whose values are names instead of quantities."""


@dataclass(frozen=True)
class Field:
    """Display of a field; the value times ``factor`` has the unit ``unit``. Kinds of fields: "linear"; "centred" on
    0; "classes", whose values are names; "fragments", with one colour for each fragment.
    """

    label: str
    unit: str = ""
    factor: float = 1.0
    colours: tuple[str, ...] = _VIRIDIS
    kind: str = "linear"
    array: str = ""
    """Name of the array in the frame; if empty, the array has the name of the field."""
    component: int | None = None
    """Component of ``array``. If None, the length of a vector is shown."""
    floor: float = 0.0
    """Size of rounding errors, in ``unit``. A field whose values differ by less counts as uniform (chosen value)."""

    def turns(self, axis: int) -> bool:
        """True if the field changes its sign in a mirror image across an axis."""
        shear = {3: (0, 1), 4: (1, 2), 5: (2, 0)}
        along = shear.get(self.component or 0, ()) if self.array == "stress" else (self.component,)
        return self.component is not None and axis in along


def _stress(label: str, **more: object) -> Field:
    return Field(label, "MPa", 1e-6, floor=1e-6, **more)  # type: ignore[arg-type]


_CENTRED = {"colours": _TWO_SIDED, "kind": "centred"}
FIELDS = {
    "mises": _stress("von Mises stress"),
    "pressure": _stress("pressure", **_CENTRED),
    "principal_stress": _stress("largest principal stress", **_CENTRED),
    "damage": Field("damage", colours=_STRAINED, floor=1e-9),
    "plastic_strain": Field("plastic strain", colours=_STRAINED, floor=1e-9),
    "temperature": Field("temperature", "K", colours=_PLASMA, floor=1e-4),
    "density": Field("density", "kg/m^3", floor=1e-4),
    "effective_strain": Field("effective strain", floor=1e-9),
    "strain_rate": Field("effective strain rate", "1/s", colours=_PLASMA, floor=1e-6),
    "contact_pressure": _stress("contact pressure", colours=_PLASMA),
    "speed": Field("speed", "m/s", colours=_CIVIDIS, array="velocity", floor=1e-6),
    "displacement": Field("displacement", "mm", 1e3, _CIVIDIS, array="displacement", floor=1e-9),
    **{
        f"velocity_{axis}": Field(f"velocity in {axis}", "m/s", 1.0, _TWO_SIDED, "centred", "velocity", i, 1e-6)
        for i, axis in enumerate("xyz")
    },
    **{
        f"stress_{axes}": _stress(f"stress {axes}", array="stress", component=i, **_CENTRED)
        for i, axes in enumerate(("xx", "yy", "zz", "xy", "yz", "zx"))
    },
    "part": Field("part", kind="classes"),
    "rank": Field("rank", kind="classes"),
    "fragment": Field("fragment", kind="fragments"),
}
"""The fields that ``conoid view`` can draw."""


def require_field(name: str) -> None:
    """Raises LookError if the field ``name`` is unknown."""
    if name not in FIELDS:
        raise LookError(f"field = {name!r}: {allowed(name, FIELDS)}")
