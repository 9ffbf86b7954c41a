"""Whether a request came over TLS: by the connection, by a trusted proxy, or to the public https address."""

from __future__ import annotations

from urllib.parse import urlsplit

from starlette.datastructures import Headers
from starlette.types import Scope


class OverTls:
    """`public_url`: TOWER_PUBLIC_URL. A proxy that does not report the scheme still passes on the host name."""

    def __init__(self, public_url: str) -> None:
        parts = urlsplit(public_url)
        self._public_host = parts.netloc.lower() if parts.scheme == "https" else None

    def __call__(self, scope: Scope) -> bool:
        """For an HTTP request or a WebSocket handshake."""
        if scope.get("scheme") in {"https", "wss"}:
            return True
        return self._public_host is not None and Headers(scope=scope).get("host", "").lower() == self._public_host
