"""Types that the models of a case have in common: base class, names, points, counts."""

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, GetJsonSchemaHandler
from pydantic_core import CoreSchema

from ..reading.files import HASH
from ..units import Length, Speed, usable

Axis = Literal["x", "y", "z"]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]{0,63}$")]
SetName = Annotated[str, Field(min_length=1, max_length=200)]
"""Name of a set in a mesh file; blanks and all letters are allowed."""
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
_Component = Annotated[float, AfterValidator(usable)]
Direction = Annotated[tuple[_Component, _Component, _Component], BeforeValidator(_floats)]


def _hash(value: str) -> str:
    if not HASH.fullmatch(value.lower()):
        raise ValueError("expected 64 hexadecimal digits, as sha256sum prints them")
    return value.lower()


Sha256 = Annotated[str, AfterValidator(_hash), Field(json_schema_extra={"pattern": "^[0-9a-fA-F]{64}$"})]
"""SHA-256 hash of a file that a case names; it is converted to lower case."""


def off(value: Any) -> Any:
    """Returns None for the text ``"none"``, and other values unchanged."""
    return None if value == "none" else value


class Switch:
    """Addition to the JSON schema of a key that also accepts ``"none"``."""

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Returns the JSON schema with the addition; pydantic calls this method."""
        schema = handler(core)
        return {**schema, "anyOf": [*schema["anyOf"], {"const": "none"}]}


class Model(BaseModel):
    """Base class of all models of a case."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, use_attribute_docstrings=True)
