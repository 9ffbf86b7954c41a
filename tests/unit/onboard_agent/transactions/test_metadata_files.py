"""The files of component metadata: CRC, compression bounds, and damaged or hostile entries."""

from __future__ import annotations

import contextlib
import gzip
import json
import lzma
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds.tiers import examples

from onboard_agent.transactions.metadata_general import (
    MetadataUnusable,
    OfferedFile,
    file_at,
    mavlink_crc32,
    parameters_file,
)
from onboard_agent.transactions.metadata_unpacking import Steps, packed_parameters, unpacked
from wire.parameter_metadata import (
    MAX_TEXT_BYTES,
    MetadataDocument,
    read_metadata,
)


def run(steps: Steps) -> bytes:
    while True:
        try:
            next(steps)
        except StopIteration as ended:
            return bytes(ended.value)


def entries_of(text: bytes) -> MetadataDocument:
    return read_metadata(gzip.decompress(run(packed_parameters(text, None))))


def test_the_crc_is_that_of_mavlink() -> None:
    # Computed with the table of PX4's generate_crc.py.
    assert mavlink_crc32(b"") == 0
    assert mavlink_crc32(b"123456789") == 0x2DFD2D88
    assert mavlink_crc32(b"\0\0\0") == 0


def test_a_crc_may_be_of_the_packed_or_of_the_unpacked_file() -> None:
    text = b'{"version":1}' * 100
    data = lzma.compress(text)
    for crc in (None, mavlink_crc32(data), mavlink_crc32(text)):
        assert run(unpacked(data, crc, max_bytes=4096)) == text
    with pytest.raises(MetadataUnusable, match="damaged"):
        run(unpacked(data, mavlink_crc32(text) ^ 1, max_bytes=4096))


def test_what_unpacks_to_more_than_fits_is_refused_before_it_is_all_there() -> None:
    packed = lzma.compress(bytes(MAX_TEXT_BYTES * 40), preset=0)
    for data in (packed, bytes(MAX_TEXT_BYTES + 1)):
        with pytest.raises(MetadataUnusable, match="too large"):
            run(packed_parameters(data, None))


def test_a_list_of_a_million_nothings_is_not_even_read() -> None:
    text = b'{"version":1,"parameters":[' + b",".join([b"0"] * 1_000_000) + b"]}"
    with pytest.raises(MetadataUnusable, match="too large"):
        run(packed_parameters(text, None))


def test_a_file_that_is_cut_off_is_damaged() -> None:
    data = lzma.compress(b"{}" * 1000)
    for cut in (7, len(data) // 2, len(data) - 1):
        with pytest.raises(MetadataUnusable):
            run(unpacked(data[:cut], None, max_bytes=4096))


def test_entries_that_are_none_are_left_out_and_the_others_stay() -> None:
    good = {"name": "A{n}_B", "min": 1, "max": 2, "units": "m", "vendorSaysMore": [1], "values": []}
    bad = [7, {}, {"name": "TOO LONG FOR A NAME OF ONE"}, {"name": "C", "min": "one"}, {"name": "D", "values": [1]}]
    text = json.dumps({"version": 3, "parameters": [*bad, good, *bad], "translation": {}}).encode()
    (entry,) = entries_of(text).parameters
    assert (entry.name, entry.min, entry.max, entry.units) == ("A{n}_B", 1.0, 2.0, "m")
    for none in (b"", b"[]", b"{", b'{"version":1}', b'{"version":1,"parameters":[]}', json.dumps({"parameters": bad})):
        with pytest.raises(MetadataUnusable):
            entries_of(none if isinstance(none, bytes) else none.encode())


@settings(max_examples=examples(20, long=120), deadline=None)
@given(
    data=st.one_of(
        st.binary(max_size=200),
        st.binary(max_size=60).map(lzma.compress),
        st.binary(max_size=60).map(lambda tail: lzma.compress(b"x" * 500)[:60] + tail),
    )
)
def test_no_file_does_worse_than_be_refused(data: bytes) -> None:
    for steps in (packed_parameters(data, None), unpacked(data, 5, max_bytes=100)):
        with contextlib.suppress(MetadataUnusable):
            run(steps)
    with contextlib.suppress(MetadataUnusable):
        parameters_file(data)


def general(*offers: dict[str, Any]) -> bytes:
    return json.dumps({"version": 1, "metadataTypes": list(offers)}).encode()


def test_the_file_of_the_parameters_is_found_on_board_or_not_at_all() -> None:
    events = {"type": 4, "uri": "mftp://events.json"}
    here = {"type": 1, "uri": "mftp://etc/extras/p.json.xz", "fileCrc": 7, "uriFallback": "https://example.invalid/p"}
    assert parameters_file(general(events, here)) == OfferedFile(b"etc/extras/p.json.xz", 7)
    swapped = {"type": 1, "uri": here["uriFallback"], "uriFallback": here["uri"], "fileCrc": 9}
    assert parameters_file(general(swapped)) == OfferedFile(b"etc/extras/p.json.xz", None)
    with pytest.raises(MetadataUnusable, match="not on board"):
        parameters_file(general({"type": 1, "uri": here["uriFallback"]}))
    with pytest.raises(MetadataUnusable, match="no metadata of its parameters"):
        parameters_file(general(events))
    assert file_at("MFTP://a", 0) == OfferedFile(b"a", None)
    assert file_at("mftp://" + "a" * 300, None) is None
