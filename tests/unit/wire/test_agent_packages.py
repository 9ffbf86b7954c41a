"""Packages of the agent: what is signed, who is believed, and how versions are compared."""

import hashlib

import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from packages.agent_update import public_text, sign

from wire.agent_update import (
    DISTRIBUTION,
    MAGIC,
    BadPackage,
    PackageHead,
    check_signature,
    make_package,
    open_head,
    read_release_key,
    text_to_sign,
    version_key,
)

KEY, OTHER = Ed25519PrivateKey.generate(), Ed25519PrivateKey.generate()
PAYLOAD = b"what Python imports"


def test_a_package_is_read_and_believed() -> None:
    package = sign(PAYLOAD, "1.2.3", ("msgspec>=0.20",), KEY)
    opened = open_head(package)
    assert (opened.head.version, opened.head.requires) == ("1.2.3", ("msgspec>=0.20",))
    assert package[opened.payload_at :] == PAYLOAD
    assert opened.head.payload_sha256 == hashlib.sha256(PAYLOAD).hexdigest()
    check_signature(opened, [public_text(OTHER), public_text(KEY)])
    for keys in ([], [public_text(OTHER)]):
        with pytest.raises(BadPackage, match="not signed by a release key"):
            check_signature(opened, keys)


def test_another_head_under_the_same_signature_is_refused() -> None:
    signed = sign(PAYLOAD, "1.2.3", (), KEY)
    with pytest.raises(BadPackage, match="not signed"):
        check_signature(open_head(signed.replace(b'"1.2.3"', b'"9.2.3"')), [public_text(KEY)])


@pytest.mark.parametrize(
    ("beginning", "words"),
    [
        (b"", "is not an update"),
        (b"PK\x03\x04", "is not an update"),
        (MAGIC + b"AAAA", "is cut off"),
        (MAGIC + b"AAAA\n{}\n", "unreadable head"),
        (MAGIC + b"!\n{}\n", "unreadable head"),
        (MAGIC + b"AAAA\n" + b"[" * 8000 + b"\n", "unreadable head"),
    ],
)
def test_what_is_no_package(beginning: bytes, words: str) -> None:
    with pytest.raises(BadPackage, match=words):
        open_head(beginning)


@pytest.mark.parametrize("version", ["../1", "1/2", "..", "", "latest", "1" * 41])
def test_a_version_is_no_path(version: str) -> None:
    head = PackageHead(distribution=DISTRIBUTION, version=version, payload_bytes=1, payload_sha256="0" * 64)
    with pytest.raises(BadPackage):
        open_head(make_package(head, b"x", KEY.sign(text_to_sign(head))))


def test_a_package_of_another_distribution_is_refused() -> None:
    head = PackageHead(distribution="control-tower", version="1.0", payload_bytes=1, payload_sha256="0" * 64)
    with pytest.raises(BadPackage, match="not of the agent"):
        open_head(make_package(head, b"x", KEY.sign(text_to_sign(head))))


def test_versions_in_order() -> None:
    ordered = ["0.2", "0.3.0.dev1", "0.3.0a1", "0.3.0b2", "0.3.0rc1", "0.3.0", "0.3.1", "0.10.0", "1.0"]
    assert sorted(ordered, key=version_key) == ordered
    assert version_key("0.3") == version_key("0.3.0")


@pytest.mark.parametrize("text", ["", "AAAA", "no base64!"])
def test_what_is_no_release_key(text: str) -> None:
    with pytest.raises(ValueError, match="must be an Ed25519 public key"):
        read_release_key(text)
