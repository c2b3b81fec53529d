"""Conversion of materials of Abaqus/Explicit to materials of Conoid (Analysis User's Guide, "Materials").

Where a formula differs between Abaqus and Conoid, the account of the import (its list of all keywords) has a note;
docs/howto/import.md compares the formulas.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from conoid.cases.reading.inp import InpError

from ..draft import Made
from ..laws import line_of, young_of
from ..units import DENSITY, RATE, SPECIFIC_HEAT, SPEED, STRESS, TEMPERATURE, System, Weighed
from .keyword import Keyword


@dataclass(frozen=True)
class Heat:
    """Settings of the deck for heat: True if plastic work heats the material (``*DYNAMIC, EXPLICIT, ADIABATIC``),
    and the temperature of absolute zero in the deck.
    """

    adiabatic: bool
    zero: float


class Material:
    """Reader of a ``*MATERIAL``, made of the keywords below it."""

    def __init__(self, head: Keyword, below: Sequence[Keyword], system: System, heat: Heat) -> None:
        """``below``: the keywords below ``*MATERIAL``, in the order of the deck."""
        self.head, self._system, self._heat = head, system, heat
        self._below = {each.word: each for each in below}
        self._done: set[str] = set()
        if len(self._below) < len(below):
            raise InpError(
                f"line {head.line}: *MATERIAL has the same keyword twice (for several conditions or temperatures)"
            )

    def made(self) -> Made:
        """Returns the material; the entries record omitted properties. Raises InpError, ValueError."""
        density = self._need("DENSITY").single(1)[0]
        material: dict[str, Any] = {"density": self._system.quantity(density, DENSITY)}
        material |= self._elastic(density)
        temperature, erosion = None, dict[str, Any]()
        if (plastic := self._take("PLASTIC")) is not None:
            kind = plastic.key("HARDENING") or "ISOTROPIC"
            if kind == "JOHNSONCOOK":
                material["strength"], temperature = self._johnson_cook(plastic)
                erosion = self._damage(material["strength"])
            elif kind == "ISOTROPIC":
                material["strength"] = self._linear(plastic)
            else:
                raise InpError(
                    f"line {plastic.line}: HARDENING = {kind}: only ISOTROPIC and JOHNSON COOK are translated"
                )
            plastic.rest()
        erosion |= self._failure(material)
        for word in ("CONDUCTIVITY", "DEPVAR"):
            self._take(word)
        heat = self._take("SPECIFIC HEAT"), self._take("INELASTIC HEAT FRACTION")
        for each in heat:
            if each is not None:
                each.entry.leave(
                    "no effect without *DYNAMIC, EXPLICIT, ADIABATIC and a strength law with a temperature"
                )
        for word, keyword in self._below.items():
            if word not in self._done:
                keyword.entry.refuse("this property of the material is not translated")
        return Made(material, erosion, temperature=temperature)

    def taken(self, place: str) -> None:
        """Marks the keywords of the material as translated to the material ``place`` of the case."""
        self.head.entry.take(place)
        for word in self._done:
            if not self._below[word].entry.decided:
                self._below[word].entry.take(place)

    def _take(self, word: str) -> Keyword | None:
        if word in self._done or word not in self._below:
            return None
        self._done.add(word)
        return self._below[word]

    def _need(self, word: str) -> Keyword:
        found = self._take(word)
        if found is None:
            raise InpError(f"line {self.head.line}: the material {self.head.get('NAME')!r} has no *{word}")
        return found

    def _stress(self, value: float) -> str | float:
        return self._system.quantity(value, STRESS)

    def _kelvin(self, value: float) -> float:
        return value - self._heat.zero

    # Elasticity and pressure ------------------------------------------------------------------------------------------

    def _elastic(self, density: float) -> dict[str, Any]:
        elastic, eos = self._need("ELASTIC"), self._take("EOS")
        kind = elastic.key("TYPE") or "ISOTROPIC"
        elastic.rest()
        if eos is None:
            if kind != "ISOTROPIC":
                raise InpError(
                    f"line {elastic.line}: TYPE = {kind}; only ISOTROPIC is translated, and SHEAR together with *EOS"
                )
            young, poisson = elastic.single(2)
            return {"elastic": {"young": self._stress(young), "poisson": poisson}}
        if eos.key("TYPE") != "USUP" or kind != "SHEAR":
            raise InpError(f"line {eos.line}: only *EOS, TYPE=USUP with *ELASTIC, TYPE=SHEAR is translated")
        eos.rest()
        speed, slope, gamma = eos.single(3)
        young, poisson = young_of(density * speed * speed, elastic.single(1)[0])
        law = {"model": "mie_gruneisen", "c0": self._system.quantity(speed, SPEED), "S": slope, "gamma0": gamma}
        return {"elastic": {"young": self._stress(young), "poisson": poisson}, "eos": law}

    # Strength ---------------------------------------------------------------------------------------------------------

    def _linear(self, plastic: Keyword) -> dict[str, Any]:
        if plastic.has("RATE") and float(plastic.get("RATE") or 0.0):
            raise InpError(
                f"line {plastic.line}: RATE: a table of the flow stress for several strain rates is not translated"
            )
        points = [(strain, stress) for stress, strain in plastic.table(2)]
        found = line_of(points)
        if found is None or found[1] < 0.0:
            raise InpError(
                f"line {plastic.line}: the flow stress over the plastic strain is not one straight line that rises "
                "from strain 0"
            )
        law: dict[str, Any] = {"model": "linear_hardening", "yield_stress": self._stress(found[0])}
        if found[1]:
            law["hardening"] = self._stress(found[1])
            last = points[-1][0]
            plastic.entry.remark("differs", f"plastic strain {last:g}", "in Abaqus the flow stress is constant "
                "beyond the last "
                                 "point; in Conoid it continues to rise")  # fmt: skip
        return law

    def _johnson_cook(self, plastic: Keyword) -> tuple[dict[str, Any], str | float]:
        A, B, n, m, melt, room = plastic.single(6)
        law: dict[str, Any] = {"model": "johnson_cook", "A": self._stress(A), "B": self._stress(B), "n": n}
        rate = self._take("RATE DEPENDENT")
        C, reference = (0.0, 0.0) if rate is None else tuple(rate.single(2))
        if rate is not None and rate.key("TYPE") != "JOHNSONCOOK":
            raise InpError(f"line {rate.line}: TYPE = {rate.key('TYPE')}; only JOHNSON COOK is translated")
        if rate is not None:
            rate.rest()
            law |= {"C": C, "reference_rate": self._system.quantity(reference, RATE)}
        else:
            law["C"] = 0.0
        if m == 0.0 or melt <= room:
            plastic.entry.remark("differs", "m", "no melting temperature: no thermal softening (taylor_quinney = 0); "
                                 "melt_temperature and specific_heat have no meaning")  # fmt: skip
            cold = self._system.quantity(max(self._kelvin(room), 0.0), TEMPERATURE)
            return law | _cold(cold), cold
        law |= {"m": m, "reference_temperature": self._system.quantity(self._kelvin(room), TEMPERATURE)}
        law["melt_temperature"] = self._system.quantity(self._kelvin(melt), TEMPERATURE)
        law |= self._heating(plastic)
        return law, self._system.quantity(max(self._kelvin(0.0), 0.0), TEMPERATURE)

    def _heating(self, plastic: Keyword) -> dict[str, Any]:
        """Reads the specific heat, and the fraction of the plastic work that becomes heat. The fraction is 0 without
        ADIABATIC.
        """
        if not self._heat.adiabatic:
            plastic.entry.remark("differs", "no heat", "without *DYNAMIC, EXPLICIT, ADIABATIC no plastic work "
                                                       "becomes heat "
                                 "(taylor_quinney = 0); specific_heat has no meaning")  # fmt: skip
            return {"specific_heat": "1000 J/kg/K", "taylor_quinney": 0.0}
        heat, share = self._need("SPECIFIC HEAT"), self._take("INELASTIC HEAT FRACTION")
        part = 0.9 if share is None or not share.filled() else share.single(1)[0]
        return {"specific_heat": self._system.quantity(heat.single(1)[0], SPECIFIC_HEAT), "taylor_quinney": part}

    # Failure ----------------------------------------------------------------------------------------------------------

    def _damage(self, law: dict[str, Any]) -> dict[str, Any]:
        """Reads ``*DAMAGE INITIATION, CRITERION=JOHNSON COOK``. The constant d3 has the opposite sign in Abaqus:
        exp(-d3 triaxiality).
        """
        found = self._below.get("DAMAGE INITIATION")
        if found is None or found.key("CRITERION") != "JOHNSONCOOK":
            return {}
        self._take("DAMAGE INITIATION")
        found.rest()
        *d, melt, room, rate = found.single(8)
        self._same(found, law, melt, room, rate)
        law["damage"] = {"D1": d[0], "D2": d[1], "D3": -d[2] + 0.0, "D4": d[3], "D5": d[4]}
        if d[2]:
            found.entry.remark(
                "differs",
                f"d3 = {d[2]:g}",
                "D3 has the opposite sign: exp(-d3 triaxiality) in Abaqus, exp(D3 triaxiality) in Conoid",
            )
        return self._evolution(found)

    def _same(self, found: Keyword, law: dict[str, Any], melt: float, room: float, rate: float) -> None:
        """Checks that the damage law and the strength law have equal temperatures and reference rates."""
        wanted = {
            "melt_temperature": self._system.quantity(self._kelvin(melt), TEMPERATURE) if melt else None,
            "reference_temperature": self._system.quantity(self._kelvin(room), TEMPERATURE) if melt else None,
            "reference_rate": self._system.quantity(rate, RATE) if rate else None,
        }  # fmt: skip
        for key, value in wanted.items():
            if value is not None and law.setdefault(key, value) != value:
                found.entry.remark(
                    "refused", f"{value}", f"in Conoid the damage law uses {key} of the strength law, {law[key]}"
                )

    def _evolution(self, found: Keyword) -> dict[str, Any]:
        """Reads the damage evolution. Without a displacement or an energy, tets are deleted as soon as the damage is
        1.
        """
        evolution = self._take("DAMAGE EVOLUTION")
        if evolution is None:
            found.entry.remark(
                "differs", "no *DAMAGE EVOLUTION", "in both codes the damage has no effect before failure"
            )
            return {}
        for name in ("TYPE", "SOFTENING", "DEGRADATION"):
            evolution.get(name)
        if any(any(row) for row in evolution.table(8)):
            evolution.entry.remark(
                "refused", "evolution", "in Abaqus the strength falls with a displacement or an energy; "
                "in Conoid a tet is deleted at damage 1",
            )  # fmt: skip
        return {"damage": 1.0}

    def _failure(self, material: dict[str, Any]) -> dict[str, Any]:
        """Reads ``*SHEAR FAILURE`` as erosion at a plastic strain, and ``*TENSILE FAILURE`` as a cut-off of the
        pressure.
        """
        shear, tensile = self._below.get("SHEAR FAILURE"), self._below.get("TENSILE FAILURE")
        found: dict[str, Any] = {}
        if shear is not None and (shear.key("TYPE") or "TABULAR") == "TABULAR":
            row = shear.single(1)
            self._take("SHEAR FAILURE")
            shear.forgive("ELEMENT DELETION", "Conoid deletes failed tets")
            found["plastic_strain"] = row[0]
        if tensile is not None:
            self._take("TENSILE FAILURE")
            tensile.entry.remark(
                "refused", "failure", "in Abaqus failed material loses its strength or is deleted; in Conoid "
                "the pressure is cut off at this value (spall)",
            )  # fmt: skip
            material["spall"] = self._stress(tensile.single(1)[0])
        return found


def _cold(room: str | float) -> dict[str, Any]:
    return {"m": 1.0, "reference_temperature": room, "melt_temperature": "2000 K", "specific_heat": "1000 J/kg/K",
            "taylor_quinney": 0.0}  # fmt: skip


def weighed(name: str, below: Sequence[Keyword]) -> Weighed | None:
    """Returns density and Young's modulus of a material, from which the import finds the units; None if a value
    cannot be read.
    """
    found = {each.word: each for each in below}
    try:
        density = found["DENSITY"].single(1)[0]
        elastic = found.get("ELASTIC")
        if elastic is None:
            return Weighed(repr(name), density, None)
        value = elastic.table(2)[0][0]
        return Weighed(repr(name), density, 2.6 * value if elastic.key("TYPE") == "SHEAR" else value)
    except (KeyError, IndexError, InpError):
        return None
