"""An update of the agent: the order for it, and the package that the agent accepts (no I/O).

A package is a file of three parts, in this order:

    b"control-tower-agent update 1\\n"
    the signature: Ed25519 by the release key over SIGNED + head, in base64, and a newline
    the head: PackageHead as JSON, and a newline
    the payload: a zip of the folders that Python imports (an agent's wheel is one)

The agent accepts a package if one of its own release keys made the signature. The tower has no part in that: it
stores and passes on, and whoever steals it can run nothing on a drone that the release key has not signed.
"""

import base64
import binascii
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Final

import msgspec
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

AGENT_UPDATE: Final = "agent-update"
"""The entry in `takes` of agents that can update themselves."""
DISTRIBUTION: Final = "control-tower-agent"
MAGIC: Final = b"control-tower-agent update 1\n"
SIGNED: Final = b"control-tower agent release\0"
MAX_HEAD_BYTES: Final = 16 * 1024
MAX_PACKAGE_BYTES: Final = 100_000_000
_VERSION: Final = re.compile(r"(\d{1,6}(?:\.\d{1,6}){0,3})(?:(\.dev|a|b|rc)(\d{1,6}))?")
_STAGES: Final = {".dev": 0, "a": 1, "b": 2, "rc": 3, None: 4}

Version = Annotated[str, msgspec.Meta(max_length=40, pattern=r"^[0-9A-Za-z.]*$")]
"""What it may be beyond this, `version_key` judges."""


class BadPackage(ValueError):
    """The message says why, as the end of a sentence about the package."""


class AgentUpdateWork(msgspec.Struct, frozen=True, tag="agent_update", tag_field="work"):
    """Fetch this release from the tower, install it and start again with it. `older`: even if it is older than what
    runs."""

    version: Version
    older: bool = False


class PackageHead(msgspec.Struct, frozen=True, kw_only=True):
    """What is signed. `requires`: the packages that must be there already, as the wheel's metadata names them."""

    distribution: str
    version: Version
    payload_bytes: Annotated[int, msgspec.Meta(ge=1, le=MAX_PACKAGE_BYTES)]
    payload_sha256: Annotated[str, msgspec.Meta(pattern=r"^[0-9a-f]{64}$")]
    requires: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class OpenedHead:
    head: PackageHead
    signed: bytes
    signature: bytes
    payload_at: int
    """Where the payload begins in the file."""


def open_head(beginning: bytes) -> OpenedHead:
    """Reads the first MAX_HEAD_BYTES of a package. Raises BadPackage."""
    if not beginning.startswith(MAGIC):
        raise BadPackage("is not an update of the agent")
    parts = beginning[len(MAGIC) :].split(b"\n", 2)
    if len(parts) != 3:
        raise BadPackage("is cut off")
    try:
        signature = base64.b64decode(parts[0], validate=True)
        head = msgspec.json.decode(parts[1], type=PackageHead)
    except (binascii.Error, msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        raise BadPackage("has an unreadable head") from None
    if head.distribution != DISTRIBUTION:
        raise BadPackage(f"is of {head.distribution[:40]!r}, not of the agent")
    version_key(head.version)
    return OpenedHead(head, SIGNED + parts[1], signature, len(MAGIC) + len(parts[0]) + len(parts[1]) + 2)


def check_signature(opened: OpenedHead, release_keys: Iterable[str]) -> None:
    """Raises BadPackage unless one of these keys signed it."""
    for key in release_keys:
        try:
            read_release_key(key).verify(opened.signature, opened.signed)
        except InvalidSignature:
            continue
        return
    raise BadPackage("is not signed by a release key of this agent")


def read_release_key(text: str) -> Ed25519PublicKey:
    """Reads a release key: 32 bytes in base64. Raises ValueError with words that follow the key's name."""
    try:
        return Ed25519PublicKey.from_public_bytes(base64.b64decode(text, validate=True))
    except (binascii.Error, ValueError):
        raise ValueError("must be an Ed25519 public key: 32 bytes in base64") from None


def make_package(head: PackageHead, payload: bytes, signature: bytes) -> bytes:
    """Returns the file. `signature`: over `text_to_sign(head)`."""
    return MAGIC + base64.b64encode(signature) + b"\n" + msgspec.json.encode(head) + b"\n" + payload


def text_to_sign(head: PackageHead) -> bytes:
    return SIGNED + msgspec.json.encode(head)


def version_key(version: str) -> tuple[tuple[int, ...], int, int]:
    """By which versions are compared: 0.3.0rc1 < 0.3.0 < 0.3.1. Raises BadPackage."""
    found = _VERSION.fullmatch(version)
    if found is None:
        raise BadPackage(f"has the version {version[:40]!r}, which cannot be compared")
    numbers = tuple(int(one) for one in found[1].split("."))
    return numbers + (0,) * (4 - len(numbers)), _STAGES[found[2]], int(found[3] or 0)
