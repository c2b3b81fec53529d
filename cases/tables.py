"""What the tables of a case are made of: the base of every model, names, places, counts."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from .units import Length, Speed

Axis = Literal["x", "y", "z"]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]{0,63}$")]
Point = tuple[Length, Length, Length]
Velocity = tuple[Speed, Speed, Speed]
Positive = Field(gt=0)


def _floats(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _no_truth(value: Any) -> Any:
    if isinstance(value, bool):
        raise ValueError("expected a whole number")
    return value


Count = Annotated[int, BeforeValidator(_no_truth)]
Direction = Annotated[tuple[float, float, float], BeforeValidator(_floats)]


class Model(BaseModel):
    """Base of everything in a case."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
