"""Binds a sign-in to its TLS channel: `tls-server-end-point` (RFC 5929, 4), the hash of the server's certificate.

Python's ssl has no exporter (RFC 9266), and its `tls-unique` is not defined for TLS 1.3. Both ends know the certificate
wherever TLS terminates, provided that the tower is configured with its proxy's certificate.
"""

import hashlib
from typing import Final

from cryptography.exceptions import UnsupportedAlgorithm

_WEAK: Final = frozenset({"md5", "sha1"})


class BadCertificate(ValueError):
    """The bytes are not an X.509 certificate."""


def end_point(certificate: bytes) -> bytes:
    """Hashes a certificate in DER with the hash of its signature; SHA-256 for MD5 and SHA-1, and for signatures without
    a hash of their own (Ed25519). Raises BadCertificate."""
    from cryptography import x509  # takes 2 MB, which an agent without a bound channel does not need

    try:
        algorithm = x509.load_der_x509_certificate(certificate).signature_hash_algorithm
    except (ValueError, UnsupportedAlgorithm) as error:
        raise BadCertificate(str(error)) from None
    name = "sha256" if algorithm is None or algorithm.name in _WEAK else algorithm.name
    return hashlib.new(name.replace("sha3-", "sha3_"), certificate).digest()
