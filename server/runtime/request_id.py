"""The id of the request that the running task works for: in log lines, audit events, answers, and at the drone's agent.

A client may send its own in `X-Request-Id`. Only letters, digits, `.`, `_` and `-` are taken over, so that nobody
forges log lines with it; anything else gets an id of the tower's.
Without that header the trace id of a `traceparent` counts.
"""

from __future__ import annotations

import re
import secrets
from contextvars import ContextVar
from typing import Final

HEADER: Final = "X-Request-Id"
MAX_LENGTH: Final = 64
_ACCEPTED: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{7,63}")
_TRACEPARENT: Final = re.compile(r"00-([0-9a-f]{32})-[0-9a-f]{16}-[0-9a-f]{2}")
_current: Final[ContextVar[str]] = ContextVar("request_id", default="")


def accepted_or_new(sent: str | None) -> str:
    """Returns what the client sent, if it is acceptable."""
    return sent if sent is not None and _ACCEPTED.fullmatch(sent) else secrets.token_hex(8)


def trace_id_in(traceparent: str | None) -> str | None:
    """Returns the trace id of a W3C `traceparent` header, by which other programs find the same request."""
    found = _TRACEPARENT.fullmatch(traceparent or "")
    return found[1] if found is not None and found[1].strip("0") else None


def begin_request(request_id: str) -> None:
    """From here on, in this task and those that it starts."""
    _current.set(request_id)


def current_request_id() -> str:
    """Empty: the work belongs to no request."""
    return _current.get()
