"""JSON schemas of the user, the server and its health."""

import msgspec


class ZenohAccess(msgspec.Struct, kw_only=True):
    """Address and credentials for a subscription to messages over Zenoh."""

    endpoint: str
    prefix: str
    user: str | None
    password: str | None


class Slots(msgspec.Struct, kw_only=True):
    """Number of cores that the runs of this server may use, and number of cores in use."""

    total: int
    used: int


class Me(msgspec.Struct, kw_only=True):
    """The user of the request, the scopes of the user's token, and the limits of the server."""

    owner: str
    scopes: list[str]
    zenoh: ZenohAccess | None
    slots: Slots
    limits: dict[str, float | None]
    quota: dict[str, float | None]
    used: dict[str, float]


class Health(msgspec.Struct, kw_only=True):
    """Status of the server, and status of each service that the server needs."""

    status: str
    checks: dict[str, bool] = {}
