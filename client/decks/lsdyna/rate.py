"""The rate factor of Cowper and Symonds, which multiplies the flow stress of several materials of LS-DYNA."""

from typing import Any

from ..units import RATE
from .elasticity import Context
from .fields import Fields


def with_rate(law: dict[str, Any], fields: Fields, context: Context, names: tuple[str, str]) -> dict[str, Any]:
    """Returns the ``strength`` of a linear law with the factor; the law itself if both fields of the factor are 0.

    ``names``: names of the fields of the rate and of the exponent. Raises ValueError if one of them alone is 0.
    """
    rate, exponent = (fields.real(name) for name in names)
    if not rate and not exponent:
        fields.forgive("VP", "how the rate counts, of a law without rate")
        return law
    if rate <= 0.0 or exponent <= 0.0:
        raise ValueError(f"{names[0]} = {rate:g} and {names[1]} = {exponent:g} are not both above 0")
    if fields.real("VP") == 0.0:
        fields.differ("VP", "rate of the total strain in LS-DYNA with VP = 0, of the plastic strain in Conoid")
    return {**law, "model": "cowper_symonds", "D": context.system.quantity(rate, RATE), "q": exponent}
