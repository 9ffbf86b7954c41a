"""The name and origin to which browsers bind passkeys. A core.

Browsers create passkeys for names only (never for an IP address), over TLS or on the same machine.
"""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass
from typing import Final
from urllib.parse import urlsplit

from server.kernel.refusal import Refusal

_DEFAULT_PORTS: Final = {"http": 80, "https": 443}
_LOCALHOST: Final = "localhost"


class PasskeysUnavailable(Refusal):
    """Passkeys cannot work at this tower's address. The message says what to set."""


@dataclass(frozen=True)
class RelyingParty:
    """`id`: the name (tower.example.org). `origin`: what a browser must report."""

    id: str
    origin: str


def relying_party(*, public_url: str, host: str, port: int) -> RelyingParty:
    """The relying party of the tower at `public_url`. Without one, this machine, if `host` (a Host header) says
    localhost.

    `port`: where the tower listens. Raises PasskeysUnavailable. The Host header is not trusted: it allows only
    localhost, at the tower's own port.
    """
    if not public_url:
        if host.rpartition("@")[2].partition(":")[0].lower() != _LOCALHOST:
            raise PasskeysUnavailable(
                "passkeys need to know the tower's address: set TOWER_PUBLIC_URL to it (https://tower.example.org), "
                f"or on this machine open http://localhost:{port}"
            )
        return RelyingParty(_LOCALHOST, _origin("http", _LOCALHOST, port))
    parts = urlsplit(public_url)
    name = _as_browsers_write(parts.hostname or "")
    if _is_address(name):
        raise PasskeysUnavailable(
            f"browsers make passkeys for names, not for addresses like {name}: "
            "give the tower a name and set TOWER_PUBLIC_URL to it"
        )
    if parts.scheme != "https" and name != _LOCALHOST and not name.endswith(f".{_LOCALHOST}"):
        raise PasskeysUnavailable(
            f"browsers make passkeys over https only: put TLS before the tower and set TOWER_PUBLIC_URL to https://{name}"
        )
    return RelyingParty(name, _origin(parts.scheme, name, parts.port))


def _origin(scheme: str, name: str, port: int | None) -> str:
    return f"{scheme}://{name}" if port in (None, _DEFAULT_PORTS[scheme]) else f"{scheme}://{name}:{port}"


def _as_browsers_write(name: str) -> str:
    try:
        return name.encode("idna").decode("ascii").lower()
    except UnicodeError:
        return name.lower()


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
