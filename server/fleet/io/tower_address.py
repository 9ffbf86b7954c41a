"""The address at which agents find this tower, for the enrolment command. Never an address that a request made up."""

from __future__ import annotations

from ipaddress import ip_address
from urllib.parse import urlsplit

from server.kernel.refusal import Refusal
from server.runtime.settings import Settings


class AddressUnknown(Refusal):
    def __init__(self) -> None:
        super().__init__(
            "the tower does not know its public address: set TOWER_PUBLIC_URL (docs/settings.md) and restart it"
        )


def address_for_agents(settings: Settings, base_url: str) -> str:
    """Returns `https://HOST[:PORT]` from the settings. Otherwise accepts from the request (`base_url`) only this
    machine's name, or the address that the tower listens on. Raises AddressUnknown."""
    if settings.public_url:
        return settings.public_url
    try:
        parts = urlsplit(base_url)
        port = parts.port
    except ValueError:
        raise AddressUnknown from None
    host = parts.hostname or ""
    if parts.scheme not in {"http", "https"} or not (_is_loopback(host) or _same_address(host, settings.host)):
        raise AddressUnknown
    name = f"[{host}]" if ":" in host else host
    return f"{parts.scheme}://{name}" + (f":{port}" if port is not None else "")


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False


def _same_address(host: str, bound: str) -> bool:
    """Compares addresses only: anybody can claim a name."""
    try:
        return ip_address(host) == ip_address(bound) and not ip_address(host).is_unspecified
    except ValueError:
        return False
