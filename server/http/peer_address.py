"""The address of a connection's peer."""

from __future__ import annotations

from starlette.requests import HTTPConnection


def address_of(connection: HTTPConnection) -> str:
    """Returns the network address of the client, for the audit trail and the throttle."""
    return connection.client.host if connection.client else ""
