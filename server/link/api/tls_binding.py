"""What the tower knows of the agents' TLS channel: the certificate of its proxy, if configured.

The tower does not terminate TLS. If TOWER_TLS_CERTIFICATE names the certificate, an agent that sees another one has an
attacker in between, and its signature is refused.
"""

from __future__ import annotations

import hmac
import ssl
from collections import deque
from pathlib import Path
from typing import Final

import structlog

from server.runtime.settings import SettingsError
from wire.channel_binding import BadCertificate, end_point

_BEGIN: Final = "-----BEGIN CERTIFICATE-----"
_END: Final = "-----END CERTIFICATE-----"
_log = structlog.get_logger(__name__)


_UNREADABLE: Final = (OSError, ValueError, BadCertificate)


def require_certificate(path: Path) -> None:
    """At the start, where a wrong path is noticed. Raises SettingsError: no agent could sign in. Later an unreadable
    file only leaves the certificates that are known."""
    try:
        _binding_of(path)
    except _UNREADABLE as error:
        why = error.strerror if isinstance(error, OSError) else "it has no certificate in PEM"
        raise SettingsError("TOWER_TLS_CERTIFICATE", f"names {path}, which cannot be used: {why}") from None


def _binding_of(path: Path) -> bytes:
    text = path.read_text()
    leaf = text[text.index(_BEGIN) : text.index(_END) + len(_END)]
    return end_point(ssl.PEM_cert_to_DER_cert(leaf))


class TlsBinding:
    """Reads the file again when it has changed, and accepts the previous certificate for the life of the process: the
    proxy may switch a little later."""

    def __init__(self, certificate: Path | None) -> None:
        self._path = certificate
        self._read_at: tuple[int, int] | None = None
        self._known: deque[bytes] = deque(maxlen=2)

    @property
    def wanted(self) -> bool:
        """Whether agents must bind their signatures."""
        return self._path is not None

    def is_ours(self, binding: bytes) -> bool:
        """Whether the agent sees the expected certificate; where none is configured, whether it binds nothing."""
        if self._path is None:
            return binding == b""
        self._check(self._path)
        return any(hmac.compare_digest(binding, one) for one in self._known)

    def _check(self, path: Path) -> None:
        try:
            found = path.stat()
            stamp = (found.st_mtime_ns, found.st_ino)
            if stamp == self._read_at:
                return
            binding = _binding_of(path)
        except _UNREADABLE as error:
            _log.error("tls_certificate_unreadable", path=str(path), error=str(error) or type(error).__name__)
            return
        self._read_at = stamp
        if binding not in self._known:
            self._known.append(binding)
