"""Kinds of problem documents, and those that belong to no refusal. Each capability has its own in `problems.py`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from server.kernel.refusal import Refusal


@dataclass(frozen=True)
class Kind:
    """`field`: the member of the request's body that was at fault, if any."""

    slug: str
    status: int
    title: str
    field: str | None = None

    def at(self, field: str) -> Kind:
        """The same problem of this member."""
        return replace(self, field=field)


INVALID: Final = Kind("invalid-request", 422, "The request is not valid")
MALFORMED_JSON: Final = Kind("malformed-json", 400, "The body is not JSON")
JSON_ONLY: Final = Kind("json-only", 415, "Only JSON is accepted")
TOO_LARGE: Final = Kind("too-large", 413, "The body is too large")
BODY_TIMEOUT: Final = Kind("request-timeout", 408, "The body did not arrive in time")
WRONG_ORIGIN: Final = Kind("wrong-origin", 403, "The request came from another site")
DATABASE: Final = Kind("database-unavailable", 503, "The database does not answer")
NOT_THE_TOWER: Final = Kind("not-the-tower", 503, "This process is not the tower")
TOWER_OUT_OF_REACH: Final = Kind("tower-out-of-reach", 503, "The drone's tower does not answer")
INTERNAL: Final = Kind("internal-error", 500, "Something went wrong in the tower")

Problems = Mapping[type[Refusal], Kind]
