"""A tower does not start with a certificate that it cannot use."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric.ec import SECP256R1, generate_private_key

from server.link.api.tls_binding import require_certificate
from server.runtime.settings import SettingsError


def test_a_certificate_of_a_proxy_is_taken(tmp_path: Path) -> None:
    key, name, now = generate_private_key(SECP256R1()), x509.Name([]), datetime.now(UTC)
    made = x509.CertificateBuilder(name, name, key.public_key(), 1, now, now + timedelta(days=1)).sign(
        key, hashes.SHA256()
    )
    path = tmp_path / "tower.pem"
    path.write_bytes(made.public_bytes(serialization.Encoding.PEM))
    require_certificate(path)


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (None, "No such file or directory"),
        ("", "it has no certificate in PEM"),
        ("-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n", "it has no certificate in PEM"),
    ],
)
def test_a_certificate_that_cannot_be_used_is_named(tmp_path: Path, content: str | None, why: str) -> None:
    path = tmp_path / "tower.pem"
    if content is not None:
        path.write_text(content)
    with pytest.raises(SettingsError, match=f"^TOWER_TLS_CERTIFICATE names {path}, which cannot be used: {why}"):
        require_certificate(path)
