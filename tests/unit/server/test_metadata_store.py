"""Agents' metadata about parameters: complete, bounded, and no more than was announced."""

from __future__ import annotations

import pytest

from server.operations.core.metadata_store import MetadataStore
from server.parameters.core.metadata import metadata_json
from wire.control_messages import MalformedMessage, decode_to_tower
from wire.parameter_metadata import (
    MAX_PACKED_BYTES,
    MetadataDocument,
    MetadataEntry,
    MetadataKnown,
    MetadataPiece,
    encode_metadata,
    metadata_hash,
    pack_text,
)

TEXT = encode_metadata(MetadataDocument(parameters=(MetadataEntry(name="ALPHA", units="m"),)))
PACKED = pack_text(TEXT)
HASH = metadata_hash(PACKED)
KNOWN = MetadataKnown(hash=HASH, size_bytes=len(PACKED))


def pieces(packed: bytes = PACKED, hash_: str = HASH, size: int = 20) -> list[MetadataPiece]:
    return [MetadataPiece(hash=hash_, offset=at, data=packed[at : at + size]) for at in range(0, len(packed), size)]


def filled() -> MetadataStore:
    store = MetadataStore()
    assert store.update_known(KNOWN) == HASH
    for piece in pieces():
        assert store.packed() is None
        store.add_piece(piece)
    assert store.packed() == PACKED
    return store


def test_what_is_lacking_is_asked_for_and_what_is_here_is_not() -> None:
    store = filled()
    assert store.update_known(KNOWN) is None
    store.forget()
    assert store.packed() is None, "whoever is there now may be another autopilot"
    assert store.update_known(KNOWN) is None
    assert store.packed() == PACKED
    other = pack_text(TEXT + b" ")
    assert store.update_known(MetadataKnown(hash=metadata_hash(other), size_bytes=len(other))) == metadata_hash(other)
    assert store.packed() is None
    store.update_known(MetadataKnown(hash=None, words="The vehicle offers none."))
    assert (store.packed(), store.words) == (None, "The vehicle offers none.")


def test_pieces_of_another_one_or_out_of_order_say_nothing() -> None:
    store = MetadataStore()
    store.add_piece(pieces()[0])
    store.update_known(KNOWN)
    for piece in (pieces()[1], pieces(hash_="0" * 16)[0]):
        store.add_piece(piece)
    for piece in pieces()[:-1]:
        store.add_piece(piece)
    for piece in pieces():  # another control channel: restarts from the first piece
        store.add_piece(piece)
    assert store.packed() == PACKED
    store.add_piece(pieces()[0])
    assert store.packed() == PACKED


def test_more_than_was_said_or_something_else_ends_the_channel() -> None:
    store = MetadataStore()
    store.update_known(MetadataKnown(hash=HASH, size_bytes=30))
    store.add_piece(pieces()[0])
    with pytest.raises(MalformedMessage):
        store.add_piece(pieces()[1])
    store = MetadataStore()
    store.update_known(KNOWN)
    with pytest.raises(MalformedMessage):
        for piece in pieces(bytes(len(PACKED))):
            store.add_piece(piece)
    assert store.packed() is None


def test_what_is_kept_is_bounded_by_the_form_of_its_messages() -> None:
    text = f'{{"type":"parameter_metadata","hash":"{HASH}","size_bytes":{MAX_PACKED_BYTES + 1}}}'
    with pytest.raises(MalformedMessage):
        decode_to_tower(text)


def test_it_is_answered_in_the_form_and_what_is_none_is_given_to_nobody() -> None:
    assert metadata_json(PACKED) == TEXT
    junk = pack_text(b'{"version":1,"parameters":7}')
    with pytest.raises(ValueError, match="no metadata"):
        metadata_json(junk)
    store = MetadataStore()
    known = MetadataKnown(hash=metadata_hash(junk), size_bytes=len(junk))
    assert store.update_known(known) == known.hash
    for piece in pieces(junk, metadata_hash(junk)):
        store.add_piece(piece)
    store.unreadable(junk)
    assert store.packed() is None
    assert store.update_known(known) is None, "it is not asked for again"
    assert store.packed() is None
    assert "not parameter metadata" in store.words
