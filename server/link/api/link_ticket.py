"""The ticket that an agent presents with its HTTP requests: sent in its link's welcome, valid while the link exists."""

from __future__ import annotations

import hmac
import re
import secrets
from datetime import datetime
from typing import Final

from starlette.requests import HTTPConnection

from server.anonymous.api.anonymous_scope import admitted
from server.http.private_path import is_private_path
from server.link.api.agent_sign_in import AgentRefused, read_credential
from server.live.hub import Hub
from wire.ids import DroneId, LinkId

_FORM: Final = re.compile(r"twl_([0-9a-f]{8})_([A-Za-z0-9_-]{43})")


def new_ticket(link_id: LinkId) -> str:
    """256 random bits, and the id of the link."""
    return f"twl_{link_id:08x}_{secrets.token_urlsafe(32)}"


def drone_of(hub: Hub, connection: HTTPConnection, *, credentials_until: datetime | None, now: datetime) -> DroneId:
    """Returns the drone of this agent: by the ticket of an existing link, or by the bearer credential of an agent
    without a key. Raises AgentRefused."""
    _, _, text = connection.headers.get("authorization", "").partition(" ")
    match = _FORM.fullmatch(text.strip())
    if match is None or not is_private_path(connection):
        return read_credential(hub, connection, until=credentials_until, now=now).drone_id
    link = hub.state.links.get(LinkId(int(match[1], 16)))
    if link is None or not hmac.compare_digest(link.ticket, text.strip()):
        raise AgentRefused(401, "unknown ticket")
    admitted(connection)
    return link.drone_id
