"""Whether a connection may carry a drone's credential: one rule for the agents' channel and for enrolment."""

from __future__ import annotations

import ipaddress

from starlette.requests import HTTPConnection

from server.kernel.refusal import Refusal


class NotPrivate(Refusal):
    def __init__(self) -> None:
        super().__init__("agents must use https: a credential must not cross the network in the clear")


def is_private_path(connection: HTTPConnection) -> bool:
    """Whether nobody can eavesdrop: TLS (here or at our proxy), or a connection from this machine."""
    if connection.url.scheme in {"wss", "https"}:
        return True
    try:
        return connection.client is not None and ipaddress.ip_address(connection.client.host).is_loopback
    except ValueError:
        return False
