"""Says to a push service which tower sends: a signed token for its origin (RFC 8292, VAPID)."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Final
from urllib.parse import urlsplit

from cryptography.hazmat.primitives.asymmetric.ec import ECDSA, EllipticCurvePrivateKey
from cryptography.hazmat.primitives.asymmetric.utils import decode_dss_signature
from cryptography.hazmat.primitives.hashes import SHA256

from server.alerts.io.push_encryption import base64url, public_bytes

VALID_FOR_S: Final = 12 * 3600
"""RFC 8292 allows a day; clocks differ."""


@dataclass(frozen=True, slots=True)
class Vapid:
    """`key`: of P-256, the tower's own. `contact`: a `mailto:` or `https:` address for the push service's operator; may
    be empty, which some push services refuse."""

    key: EllipticCurvePrivateKey
    contact: str

    @property
    def public_key(self) -> str:
        """The uncompressed point as base64url: what a browser subscribes with."""
        return base64url(public_bytes(self.key.public_key()))

    def authorization(self, endpoint: str, now_s: int) -> str:
        """Returns the value of the header `Authorization`."""
        parts = urlsplit(endpoint)
        claims: dict[str, object] = {"aud": f"{parts.scheme}://{parts.netloc}", "exp": now_s + VALID_FOR_S}
        if self.contact:
            claims["sub"] = self.contact
        signed = f"{_part({'typ': 'JWT', 'alg': 'ES256'})}.{_part(claims)}"
        r, s = decode_dss_signature(self.key.sign(signed.encode(), ECDSA(SHA256())))
        signature = base64url(r.to_bytes(32, "big") + s.to_bytes(32, "big"))
        return f"vapid t={signed}.{signature}, k={self.public_key}"


def _part(value: dict[str, object]) -> str:
    return base64url(json.dumps(value, separators=(",", ":")).encode())
