"""From where a connection comes."""

from __future__ import annotations

from starlette.requests import HTTPConnection


def address_of(connection: HTTPConnection) -> str:
    """The network address of the other side, for the audit trail and the throttle."""
    return connection.client.host if connection.client else ""
