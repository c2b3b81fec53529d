"""JSON schemas of the material library."""

import msgspec


class LibraryConstant(msgspec.Struct, kw_only=True):
    """A constant of a material: ``value`` in the form of a case, such as ``7850 kg/m^3``; ``confidence``: paper, read,
    derived, memory or assumed; ``source``: text of the source.
    """

    key: str
    value: str
    confidence: str
    source: str


class LibraryMaterial(msgspec.Struct, kw_only=True):
    """A material of the library; ``law`` is the value of ``strength.model``, empty for an elastic material."""

    name: str
    description: str
    law: str
    constants: list[LibraryConstant]


class Materials(msgspec.Struct, kw_only=True):
    """The material library."""

    materials: list[LibraryMaterial]
