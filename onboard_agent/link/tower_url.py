"""The tower's address as people write it, and the two addresses that the agent derives from it."""

from dataclasses import dataclass
from ipaddress import ip_address
from typing import Final
from urllib.parse import urlsplit

from onboard_agent.unusable import Unusable

_CHANNEL_PATH: Final = "/api/v1/agent"
_VIDEO_PATH: Final = "/api/v1/agent/video"
_DEFAULT_PORTS: Final = {"https": 443, "http": 80}


@dataclass(frozen=True)
class TowerUrl:
    """Address of the tower. `secure`: TLS; without it the agent connects only to loopback addresses."""

    host: str
    port: int
    secure: bool

    @property
    def channel(self) -> str:
        """The control channel's WebSocket address."""
        return self._websocket(_CHANNEL_PATH)

    @property
    def video_channel(self) -> str:
        """The video channel's WebSocket address."""
        return self._websocket(_VIDEO_PATH)

    def _websocket(self, path: str) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{'wss' if self.secure else 'ws'}://{host}:{self.port}{path}"

    @property
    def name(self) -> str:
        """`HOST:PORT`, by which a sign-in names the tower (wire.sign_in)."""
        return str(self).partition("://")[2].lower()

    def __str__(self) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{'https' if self.secure else 'http'}://{host}:{self.port}"


def is_loopback(host: str) -> bool:
    """Whether connections to this host name or address never leave this machine."""
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False


def parse_tower_url(text: str) -> TowerUrl:
    """Parses `https://HOST[:PORT]`, or `http://` with a loopback host. Raises Unusable with the reason."""
    try:
        parts = urlsplit(text.strip())
        port = parts.port
    except ValueError as error:
        raise Unusable(f"the tower's address {text!r} is not an address: {error}") from None
    if parts.scheme not in _DEFAULT_PORTS or not parts.hostname:
        raise Unusable(f"the tower's address {text!r} must look like https://tower.example.org")
    if parts.path not in ("", "/") or parts.query or parts.fragment or "@" in parts.netloc:
        raise Unusable(f"the tower's address {text!r} must be only https://HOST or https://HOST:PORT")
    secure = parts.scheme == "https"
    if not secure and not is_loopback(parts.hostname):
        raise Unusable(
            f"the tower's address {text!r} is plain http: the drone's credential would cross the network readable; "
            "use https (plain http is for a tower on this same machine)"
        )
    return TowerUrl(parts.hostname, _DEFAULT_PORTS[parts.scheme] if port is None else port, secure)
