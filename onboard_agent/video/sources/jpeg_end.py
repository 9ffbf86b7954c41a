"""Finds the end of a JPEG that arrives piece by piece (ITU-T T.81, annex B; no I/O)."""

import re
from typing import Final

_MARKER: Final = 0xFF
_START: Final = 0xD8
_END: Final = 0xD9
_SCAN: Final = 0xDA
_ALONE: Final = frozenset({0x01, *range(0xD0, 0xD8)})
_SOMETHING_ENDS_SCAN: Final = re.compile(rb"\xff[^\x00\xd0-\xd7\xff]")


class NotJpeg(ValueError):
    """The data does not begin or continue as a JPEG."""


class JpegEnd:
    """Continues where it stopped, so that no byte is read twice. Skips a thumbnail inside the header."""

    def __init__(self) -> None:
        self._at = 0
        self._in_scan = False

    def find(self, data: bytearray) -> int | None:
        """Returns the size of the picture in `data`; None if more is needed. `data` only grows. Raises NotJpeg."""
        while True:
            if self._in_scan:
                found = _SOMETHING_ENDS_SCAN.search(data, self._at)
                if found is None:
                    self._at = max(self._at, len(data) - 1)
                    return None
                self._at, self._in_scan = found.start(), False
            if len(data) < self._at + 2:
                return None
            marker = data[self._at + 1]
            if data[self._at] != _MARKER or (self._at == 0 and marker != _START):
                raise NotJpeg("what comes is no JPEG")
            if marker == _END:
                return self._at + 2
            if marker == _MARKER:  # a fill byte
                self._at += 1
            elif marker == _START or marker in _ALONE:
                self._at += 2
            elif not self._step_over(data, marker):
                return None

    def _step_over(self, data: bytearray, marker: int) -> bool:
        if len(data) < self._at + 4:
            return False
        self._at += 2 + int.from_bytes(data[self._at + 2 : self._at + 4])
        self._in_scan = marker == _SCAN
        return True
