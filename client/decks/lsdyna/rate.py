"""The rate factor of Cowper and Symonds, which multiplies the flow stress of several materials of LS-DYNA."""

from typing import Any

from ..units import RATE
from .elasticity import Context
from .fields import Fields


def with_rate(law: dict[str, Any], fields: Fields, context: Context, names: tuple[str, str]) -> dict[str, Any]:
    """Returns the ``strength`` table of a linear law with the rate factor added; the unchanged table if both fields of
    the factor are 0.

    ``names``: names of the fields of the rate and of the exponent. Raises ValueError if only one of the two fields
    is 0.
    """
    rate, exponent = (fields.real(name) for name in names)
    if not rate and not exponent:
        fields.forgive("VP", "setting of the rate; the law has no rate")
        return law
    if rate <= 0.0 or exponent <= 0.0:
        raise ValueError(f"{names[0]} = {rate:g} and {names[1]} = {exponent:g} are not both above 0")
    if fields.real("VP") == 0.0:
        fields.differ(
            "VP", "with VP = 0 LS-DYNA uses the rate of the total strain, Conoid the rate of the plastic strain"
        )
    return {**law, "model": "cowper_symonds", "D": context.system.quantity(rate, RATE), "q": exponent}
