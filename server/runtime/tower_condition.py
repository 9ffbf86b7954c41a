"""Measures what can go wrong with the tower's machine: free disk space, and the end of its TLS certificate. Blocks."""

from __future__ import annotations

import shutil
import socket
import ssl
from datetime import datetime
from pathlib import Path
from typing import Final, NamedTuple
from urllib.parse import urlsplit

from cryptography import x509

WITHIN_S: Final = 10.0
"""For each answer of the server that shows a certificate."""
_BEGIN: Final = b"-----BEGIN CERTIFICATE-----"


class DiskSpace(NamedTuple):
    """`device`: the same for folders of one disk."""

    device: int
    free_bytes: int


def disk_space(folder: Path) -> DiskSpace:
    """Of the disk that the folder is on; of a folder that does not exist, where it would be. Raises OSError."""
    there = next((one for one in (folder, *folder.parents) if one.exists()), folder)
    return DiskSpace(there.stat().st_dev, shutil.disk_usage(there).free)


def stored_certificate_ends_at(path: Path) -> datetime:
    """When the first certificate of a PEM file expires. Raises OSError and ValueError."""
    text = path.read_bytes()
    return x509.load_pem_x509_certificate(text[max(text.find(_BEGIN), 0) :]).not_valid_after_utc


def shown_certificate_ends_at(address: str, server_name: str) -> datetime:
    """When the certificate expires that `address` (host:port) shows to clients of `server_name`. Whether it is valid
    does not matter. Raises OSError and ValueError."""
    parts = urlsplit(f"//{address}")
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    with (
        socket.create_connection((parts.hostname or "", parts.port or 443), timeout=WITHIN_S) as plain,
        context.wrap_socket(plain, server_hostname=server_name or parts.hostname) as connection,
    ):
        shown = connection.getpeercert(binary_form=True)
    if shown is None:
        raise ValueError("it shows no certificate")
    return x509.load_der_x509_certificate(shown).not_valid_after_utc
