"""One flight with its index as one JSON document: the lines of the file go into it as they are, in order of time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import msgspec

from server.flights.core.index import MAX_INDEX_BYTES
from server.flights.core.views import FlightVideoView, FlightView
from server.flights.store.files import FlightFiles


class _Dated(msgspec.Struct):
    at_us: int = 0


_decoder: Final = msgspec.json.Decoder(_Dated)
_objects: Final = msgspec.json.Decoder(dict[str, Any])


def index_entries(files: FlightFiles, drone_id: int, file: str) -> tuple[list[dict[str, Any]], bool]:
    """Returns the index in order of time, and whether it is whole. Blocking; call it in a thread."""
    lines, is_whole = _lines(files, drone_id, file)
    return [_objects.decode(line) for line in lines], is_whole


def _lines(files: FlightFiles, drone_id: int, file: str) -> tuple[list[bytes], bool]:
    try:
        lines = files.read_index(drone_id, file)
    except FileNotFoundError:
        lines = []
    is_whole = sum(map(len, lines)) + len(lines) < MAX_INDEX_BYTES - 64 * 1024
    lines.sort(key=lambda line: _decoder.decode(line).at_us)  # a command's line is written with its answer
    return lines, is_whole


def detail_document(
    files: FlightFiles | None, drone_id: int, file: str, view: FlightView, video: Sequence[FlightVideoView]
) -> bytes:
    """A FlightDetailView. `files`: None where the index is elsewhere. Blocking; call it in a thread."""
    lines, is_whole = ([], True) if files is None else _lines(files, drone_id, file)
    head = view.model_dump_json()[:-1].encode()
    videos = b",".join(one.model_dump_json().encode() for one in video)
    tail = b"true" if is_whole else b"false"
    return b"".join((head, b',"video":[', videos, b'],"index":[', b",".join(lines), b'],"index_is_whole":', tail, b"}"))
