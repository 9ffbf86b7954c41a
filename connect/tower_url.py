"""The tower's address, and the rule that no token crosses a network unencrypted. Pure."""

from dataclasses import dataclass
from ipaddress import ip_address
from typing import Final
from urllib.parse import urlsplit

from connect.unusable import Unusable

_API: Final = "/api/v1"


@dataclass(frozen=True)
class TowerUrl:
    """`origin` is the given address without a trailing slash."""

    origin: str

    @property
    def secure(self) -> bool:
        """Whether the token is encrypted in transit. If not, it must not leave this machine: no proxy."""
        return self.origin.startswith("https:")

    @property
    def api(self) -> str:
        """The prefix of REST paths."""
        return self.origin + _API

    def live(self, *, watch_only: bool) -> str:
        """Returns the address of the live channel. `watch_only` requests less than the token allows."""
        address = self.origin.replace("http", "ws", 1) + _API + "/live"
        return f"{address}?scopes=watch" if watch_only else address


def is_loopback(host: str) -> bool:
    """Returns whether traffic to a host never leaves this machine."""
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False


def parse_tower_url(text: str) -> TowerUrl:
    """Parses `https://HOST[:PORT]`, or `http://` with a loopback host. Raises Unusable with the reason."""
    text = text.strip().rstrip("/")
    try:
        parts = urlsplit(text)
        _ = parts.port
    except ValueError as error:
        raise Unusable(f"the tower's address {text!r} is not an address: {error}") from None
    if parts.scheme not in ("http", "https") or not parts.hostname or "@" in parts.netloc:
        raise Unusable(f"the tower's address {text!r} must look like https://tower.example.org")
    if parts.path or parts.query or parts.fragment:
        raise Unusable(f"the tower's address {text!r} must be only https://HOST or https://HOST:PORT")
    if parts.scheme == "http" and not is_loopback(parts.hostname):
        raise Unusable(f"{text} is plain http: the token would cross the network readable; use https")
    return TowerUrl(text)
