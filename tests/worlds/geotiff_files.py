"""Writes small GeoTIFF files byte by byte."""

import struct
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

WGS84: Final = {1024: 2, 1025: 1, 2048: 4326}
_FORMS: Final = {2: "s", 3: "H", 4: "I", 12: "d", 16: "Q"}


def projected(code: int) -> dict[int, int]:
    return {1024: 1, 1025: 1, 3072: code}


@dataclass(frozen=True)
class Geotiff:
    """`values`: rows from north to south. `tile`: side in pixels; 0: strips of `strip_rows`."""

    values: np.ndarray[Any, Any]
    west: float = 8.0
    north: float = 47.0
    step_x: float = 1 / 3600
    step_y: float = 1 / 3600
    keys: dict[int, int] = field(default_factory=lambda: WGS84)
    order: Literal["<", ">"] = "<"
    is_big: bool = False
    tile: int = 0
    strip_rows: int = 7
    is_deflated: bool = False
    predictor: int = 1
    nodata: str = ""
    changed_tags: dict[int, tuple[int, tuple[Any, ...]] | None] = field(default_factory=dict)
    """Tag to type and values; None: left out."""

    def write(self, file: Path) -> Path:
        rows, columns = self.values.shape
        blocks = [self._packed(block) for block in self._blocks()]
        head = 16 if self.is_big else 8
        starts = [head + sum(map(len, blocks[:at])) for at in range(len(blocks))]
        kind = {"u": 1, "i": 2, "f": 3}[self.values.dtype.kind]
        long = 16 if self.is_big else 4
        tags: dict[int, tuple[int, tuple[Any, ...]] | None] = {
            256: (4, (columns,)),
            257: (4, (rows,)),
            258: (3, (self.values.dtype.itemsize * 8,)),
            259: (3, (8 if self.is_deflated else 1,)),
            262: (3, (1,)),
            277: (3, (1,)),
            317: (3, (self.predictor,)),
            339: (3, (kind,)),
            33550: (12, (self.step_x, self.step_y, 0.0)),
            33922: (12, (0.0, 0.0, 0.0, self.west, self.north, 0.0)),
            34735: (3, (1, 1, 0, len(self.keys), *(n for key, what in self.keys.items() for n in (key, 0, 1, what)))),
        }
        sizes = tuple(map(len, blocks))
        if self.tile:
            tags |= {322: (3, (self.tile,)), 323: (3, (self.tile,)), 324: (long, tuple(starts)), 325: (4, sizes)}
        else:
            tags |= {273: (long, tuple(starts)), 278: (3, (self.strip_rows,)), 279: (4, sizes)}
        if self.nodata:
            tags[42113] = (2, (self.nodata.encode() + b"\0",))
        tags |= self.changed_tags
        at = head + sum(sizes)
        at += at % 2
        body = b"".join(blocks).ljust(at - head, b"\0")
        file.write_bytes(self._head(at) + body + self._directory(at, {k: v for k, v in tags.items() if v is not None}))
        return file

    def _head(self, at: int) -> bytes:
        mark = b"II" if self.order == "<" else b"MM"
        if self.is_big:
            return mark + struct.pack(f"{self.order}3HQ", 43, 8, 0, at)
        return mark + struct.pack(f"{self.order}HI", 42, at)

    def _directory(self, at: int, tags: dict[int, tuple[int, tuple[Any, ...]]]) -> bytes:
        number, inline, count = ("Q", 8, "Q") if self.is_big else ("I", 4, "H")
        entries, more = b"", b""
        after = at + struct.calcsize(f"<{count}") + len(tags) * (12 + 2 * (inline - 4)) + inline
        for tag, (kind, values) in sorted(tags.items()):
            form = _FORMS[kind]
            raw = values[0] if form == "s" else struct.pack(f"{self.order}{len(values)}{form}", *values)
            entries += struct.pack(f"{self.order}HH{number}", tag, kind, len(raw) if form == "s" else len(values))
            if len(raw) <= inline:
                entries += raw.ljust(inline, b"\0")
            else:
                entries += struct.pack(f"{self.order}{number}", after + len(more))
                more += raw
        return struct.pack(f"{self.order}{count}", len(tags)) + entries + bytes(inline) + more

    def _blocks(self) -> list[np.ndarray[Any, Any]]:
        rows, columns = self.values.shape
        if not self.tile:
            return [self.values[at : at + self.strip_rows] for at in range(0, rows, self.strip_rows)]
        side = self.tile
        whole = np.pad(self.values, ((0, -rows % side), (0, -columns % side)))
        return [
            whole[y : y + side, x : x + side]
            for y in range(0, whole.shape[0], side)
            for x in range(0, whole.shape[1], side)
        ]

    def _packed(self, block: np.ndarray[Any, Any]) -> bytes:
        size = block.dtype.itemsize
        if self.predictor == 3:
            raw = np.ascontiguousarray(block.astype(block.dtype.newbyteorder(">")))
            planes = raw.view(np.uint8).reshape(*block.shape, size).transpose(0, 2, 1).reshape(len(block), -1)
            out = np.diff(planes, axis=1, prepend=np.uint8(0)).tobytes()
        else:
            whole = np.ascontiguousarray(block).view(f"u{size}")
            if self.predictor == 2:
                whole = np.diff(whole, axis=1, prepend=whole.dtype.type(0))
            out = whole.astype(whole.dtype.newbyteorder(self.order)).tobytes()
        return zlib.compress(out) if self.is_deflated else out
