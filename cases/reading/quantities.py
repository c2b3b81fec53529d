"""The units of all measured quantities of a run, and the reading of the values of ``[[reference]]``."""

from collections.abc import Mapping, Sequence
from typing import Any

from ..units import parse_quantity
from .problems import Location, Problem, problem
from .similar import nearest

FIELD_UNITS: dict[str, str] = {
    "stress_xx": "Pa", "stress_yy": "Pa", "stress_zz": "Pa", "stress_yz": "Pa", "stress_zx": "Pa", "stress_xy": "Pa",
    "pressure": "Pa", "mises": "Pa", "plastic_strain": "", "damage": "", "temperature": "K", "density": "kg/m^3",
    "internal_energy": "J/kg", "velocity_x": "m/s", "velocity_y": "m/s", "velocity_z": "m/s",
    "contact_force_x": "N", "contact_force_y": "N", "contact_force_z": "N",
    "wall_force_x": "N", "wall_force_y": "N", "wall_force_z": "N",
    "contact_impulse_x": "N s", "contact_impulse_y": "N s", "contact_impulse_z": "N s",
    "wall_impulse_x": "N s", "wall_impulse_y": "N s", "wall_impulse_z": "N s",
    "wall_position_x": "m", "wall_position_y": "m", "wall_position_z": "m",
    "wall_velocity_x": "m/s", "wall_velocity_y": "m/s", "wall_velocity_z": "m/s", "mass": "kg",
    "momentum_x": "kg m/s", "momentum_y": "kg m/s", "momentum_z": "kg m/s", "kinetic_energy": "J",
    "centre_x": "m", "centre_y": "m", "centre_z": "m", "centre_velocity_x": "m/s", "centre_velocity_y": "m/s",
    "centre_velocity_z": "m/s", "residual_velocity": "m/s", "residual_mass": "kg", "fragment_velocity": "m/s",
    "fragment_mass": "kg", "penetration": "m", "hole_diameter": "m", "hole_width": "m", "cone_angle": "",
    "pressure_max": "Pa", "pressure_min": "Pa", "mises_max": "Pa", "plastic_strain_max": "", "damage_max": "",
    "temperature_max": "K",
}  # fmt: skip
"""Unit of every field of a probe."""

QUANTITY_UNITS: dict[str, str] = {
    "extent": "m", "radius": "m", "plastic_strain_max": "", "temperature_max": "K", "speed_mean": "m/s",
    "stress_max": "Pa", "contact_time": "s", "contact_loss": "", "penetration": "m", "worst_residual": "",
}  # fmt: skip
"""Unit of every reference quantity that does not use a probe."""


def unit_of(quantity: str, field: str | None = None) -> str:
    """Returns the unit of a reference quantity. ``field``: field of the probe that the reference names. Raises KeyError
    if the quantity or the field is unknown.
    """
    return FIELD_UNITS[field or ""] if quantity.startswith("probe_") else QUANTITY_UNITS[quantity]


def unit_of_reference(data: Mapping[str, Any], location: Location) -> str:
    """Returns the unit of ``value`` or ``tolerance`` of a reference of a valid case, at ``("reference", 0,
    "value")``."""
    return _unit(data["reference"][location[1]], data)


def read_references(data: Mapping[str, Any]) -> tuple[dict[str, Any], list[Problem]]:
    """Returns ``data`` with reference values and tolerances such as ``"21.47 mm"`` converted to SI units, and the
    errors in them.

    A value that cannot be read becomes 1.0, so that pydantic does not report it a second time.
    """
    listed = data.get("reference")
    if not isinstance(listed, Sequence) or isinstance(listed, str):
        return dict(data), []
    problems: list[Problem] = []
    read = [
        _read(entry, data, ("reference", i), problems) if isinstance(entry, Mapping) else entry
        for i, entry in enumerate(listed)
    ]
    return {**data, "reference": read}, problems


def _read(
    entry: Mapping[str, Any], data: Mapping[str, Any], location: Location, problems: list[Problem]
) -> dict[str, Any]:
    numbers: dict[str, Any] = {}
    for key in ("value", "tolerance"):
        if not isinstance(entry.get(key), str):
            continue
        try:
            numbers[key] = parse_quantity(entry[key], _unit(entry, data))
        except ValueError as error:
            numbers[key] = 1.0
            problems.append(problem((*location, key), entry[key], str(error)))
    return {**entry, **numbers}


def _unit(entry: Mapping[str, Any], data: Mapping[str, Any]) -> str:
    quantity = str(entry.get("quantity"))
    if not quantity.startswith("probe_"):
        if quantity not in QUANTITY_UNITS:
            raise ValueError(f"the unit depends on the quantity; {nearest(quantity, [*QUANTITY_UNITS, *_PROBED])}")
        return QUANTITY_UNITS[quantity]
    fields = {str(probe.get("name")): str(probe.get("field")) for probe in _tables(data.get("probes"))}
    name = str(entry.get("probe"))
    if name not in fields:
        raise ValueError(f"the unit depends on the probe, and there is no probe {name!r}; {nearest(name, fields)}")
    if fields[name] not in FIELD_UNITS:
        raise ValueError(f"the unit depends on the field of probe {name!r}; {nearest(fields[name], FIELD_UNITS)}")
    return FIELD_UNITS[fields[name]]


_PROBED = ("probe_mean", "probe_max", "probe_min", "probe_last")


def _tables(value: object) -> list[Mapping[str, Any]]:
    return [entry for entry in value if isinstance(entry, Mapping)] if isinstance(value, list | tuple) else []
