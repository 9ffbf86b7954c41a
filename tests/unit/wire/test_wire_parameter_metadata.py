"""A vehicle's metadata about its parameters: packed, bounded, and sent only to sides that support it."""

from __future__ import annotations

import contextlib
import zlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wire.control_messages import decode_to_agent, decode_to_tower, encode_message
from wire.dialect import CRC_EXTRA
from wire.parameter_metadata import (
    MAX_COMMAS,
    MAX_PIECE_BYTES,
    MAX_TEXT_BYTES,
    MetadataBit,
    MetadataChoice,
    MetadataDocument,
    MetadataEntry,
    MetadataKnown,
    MetadataPiece,
    MetadataWanted,
    encode_metadata,
    metadata_hash,
    pack_text,
    read_metadata,
    unpack_text,
)

ENTRY = MetadataEntry(
    name="RTL_ALT",
    type="Int32",
    short_desc="Height",
    default=1500.0,
    min=30.0,
    values=(MetadataChoice(0.0, "None"),),
    bitmask=(MetadataBit(3, "Three"),),
)


def test_a_document_is_the_same_after_its_way_and_the_same_bytes_each_time() -> None:
    document = MetadataDocument(parameters=(ENTRY, MetadataEntry(name="OUT{n}_MIN")))
    packed = pack_text(encode_metadata(document))
    assert packed == pack_text(encode_metadata(document))
    assert read_metadata(unpack_text(packed)) == document
    assert len(metadata_hash(packed)) == 16
    assert encode_metadata(MetadataDocument(parameters=(ENTRY,))) == (
        b'{"version":1,"parameters":[{"name":"RTL_ALT","type":"Int32","shortDesc":"Height","default":1500.0,"min":30.0,'
        b'"values":[{"value":0.0,"description":"None"}],"bitmask":[{"index":3,"description":"Three"}]}]}'
    )


@pytest.mark.parametrize(
    "packed",
    [
        b"",
        zlib.compress(b"{}"),
        pack_text(b"{}")[:-1],
        pack_text(b"{}") + b"x",
        pack_text(bytes(MAX_TEXT_BYTES + 1)),
    ],
    ids=["nothing", "zlib", "cut", "more", "bomb"],
)
def test_bytes_that_are_none_are_refused(packed: bytes) -> None:
    with pytest.raises(ValueError, match="no metadata"):
        unpack_text(packed)


@pytest.mark.parametrize(
    "text",
    [b"", b"{}", b'{"version":2,"parameters":[]}', b'{"parameters":[{"name":"no name"}]}', b"," * (MAX_COMMAS + 1)],
    ids=["nothing", "object", "version", "name", "commas"],
)
def test_texts_that_are_none_are_refused(text: bytes) -> None:
    with pytest.raises(ValueError, match="no metadata"):
        read_metadata(text)


@given(st.binary(max_size=300))
def test_any_bytes_are_read_or_refused(data: bytes) -> None:
    for read in (unpack_text, read_metadata):
        with contextlib.suppress(ValueError):
            read(data)


def test_its_messages_fit_the_channel_and_come_through() -> None:
    known = MetadataKnown(hash="0" * 16, size_bytes=5)
    piece = MetadataPiece(hash="0" * 16, offset=0, data=bytes(MAX_PIECE_BYTES))
    for message in (known, piece):
        assert decode_to_tower(encode_message(message)) == message
    assert len(encode_message(piece)) < 20_000
    wanted = MetadataWanted(hash="0" * 16)
    assert decode_to_agent(encode_message(wanted)) == wanted


def test_the_seed_of_the_message_that_the_dialect_lacks_is_that_of_its_fields() -> None:
    """Computed as the MAVLink serialization guide specifies."""
    crc = 0xFFFF
    for byte in b"COMPONENT_METADATA uint32_t time_boot_ms uint32_t file_crc char uri " + bytes([100]):
        low = byte ^ (crc & 0xFF)
        low ^= (low << 4) & 0xFF
        crc = (crc >> 8) ^ (low << 8) ^ (low << 3) ^ (low >> 4)
    assert CRC_EXTRA[397] == (crc & 0xFF) ^ (crc >> 8)
