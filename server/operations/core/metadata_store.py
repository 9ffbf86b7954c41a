"""Metadata that a vehicle offers for its own parameters, as its agent sends it in pieces. State and checks; no I/O.

Kept packed, at most MAX_PACKED_BYTES for each drone. Unpacked on request, outside the event loop, which forwards
frames.
"""

from typing import Final

from wire.control_messages import MalformedMessage
from wire.parameter_metadata import MetadataKnown, MetadataPiece, metadata_hash

NOT_REPORTED: Final = "Its agent has reported none."
COMING: Final = "It is on its way from the drone."
UNREADABLE: Final = "What its agent sent is not parameter metadata."


class MetadataStore:
    """One for each drone."""

    def __init__(self) -> None:
        self.words = NOT_REPORTED
        """Why there is none."""
        self.reported: str | None = None
        """The last reported hash."""
        self._size = 0
        self._hash: str | None = None
        self._packed = b""
        self._coming = bytearray()

    def update_known(self, reported: MetadataKnown) -> str | None:
        """The hash to ask for, where it is not here."""
        self.reported, self._size = reported.hash, reported.size_bytes
        bad = reported.hash is not None and reported.hash == self._hash and not self._packed
        self.words = reported.words or (UNREADABLE if bad else COMING)
        self._coming.clear()
        return reported.hash if reported.hash is not None and reported.hash != self._hash else None

    def add_piece(self, piece: MetadataPiece) -> None:
        """Ignores pieces of another one, and those out of order. Raises MalformedMessage if the whole does not match
        its hash."""
        if piece.hash != self.reported or piece.hash == self._hash:
            return
        if piece.offset == 0:
            self._coming.clear()
        if piece.offset != len(self._coming):
            return
        self._coming += piece.data
        if len(self._coming) > self._size:
            raise MalformedMessage("more metadata than announced")
        if len(self._coming) == self._size:
            whole = bytes(self._coming)
            self._coming.clear()
            if metadata_hash(whole) != piece.hash:
                raise MalformedMessage("metadata that does not match its hash")
            self._packed, self._hash = whole, piece.hash

    def packed(self) -> bytes | None:
        """The metadata of the last reported hash; None if it is missing."""
        return (self._packed or None) if self.reported is not None and self.reported == self._hash else None

    def unreadable(self, packed: bytes) -> None:
        """These bytes are not metadata: they are not served."""
        if packed == self._packed:
            self._packed, self.words = b"", UNREADABLE

    def forget(self) -> None:
        """The agent's link is gone. The metadata stays until the agent reports another hash."""
        self.reported, self.words = None, NOT_REPORTED
        self._coming.clear()
