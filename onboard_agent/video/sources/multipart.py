"""Extracts the pictures of a multipart/x-mixed-replace stream, each as soon as its last byte arrives (no I/O).

Without a length, FFmpeg waits for the next part: one picture late. A JPEG itself marks its end.
"""

from typing import Final, NamedTuple

from onboard_agent.video.sources.jpeg_end import JpegEnd, NotJpeg

MAX_PICTURE_BYTES: Final = 8 * 1024 * 1024
_MAX_HEAD_BYTES: Final = 8 * 1024


class Malformed(ValueError):
    """The stream does not consist of pictures in parts."""


class Part(NamedTuple):
    """`began_us`: arrival of the first byte after the boundary line, which many cameras send with the previous picture.
    `headers`: names in lower case."""

    picture: bytes
    headers: dict[str, str]
    began_us: int


class MultipartPictures:
    """Bytes in, pictures out."""

    def __init__(self) -> None:
        self._bytes = bytearray()
        self._headers: dict[str, str] | None = None
        self._length: int | None = None
        self._end = JpegEnd()
        self._began_us: int | None = None

    def feed(self, data: bytes, now_us: int) -> list[Part]:
        """Takes received bytes and returns the complete pictures. Raises Malformed."""
        self._bytes += data
        parts: list[Part] = []
        while True:
            if self._headers is None and not self._take_head(now_us):
                return parts
            size = self._size()
            if size is None:
                if len(self._bytes) > MAX_PICTURE_BYTES:
                    raise Malformed(f"a picture of more than {MAX_PICTURE_BYTES} bytes")
                return parts
            assert self._headers is not None and self._began_us is not None
            if size:
                parts.append(Part(bytes(self._bytes[:size]), self._headers, self._began_us))
            del self._bytes[:size]
            self._headers = self._began_us = None

    def _take_head(self, now_us: int) -> bool:
        """Takes the boundary, and the header lines up to the empty line."""
        blank = len(self._bytes) - len(self._bytes.lstrip(b"\r\n"))
        del self._bytes[:blank]
        boundary_ends = self._bytes.find(b"\r\n")
        if 0 <= boundary_ends < len(self._bytes) - 2 and self._began_us is None:
            self._began_us = now_us
        head, end, _ = self._bytes.partition(b"\r\n\r\n")
        if not end:
            if len(self._bytes) > _MAX_HEAD_BYTES:
                raise Malformed("no picture begins")
            return False
        headers = {}
        for line in head.split(b"\r\n"):
            name, colon, value = line.partition(b":")
            if colon:
                headers[name.strip().lower().decode("latin-1")] = value.strip().decode("latin-1")
        del self._bytes[: len(head) + len(end)]
        self._headers = headers
        self._length = self._given_length(headers)
        self._end = JpegEnd()
        return True

    def _given_length(self, headers: dict[str, str]) -> int | None:
        text = headers.get("content-length", "")
        if not (text.isascii() and text.isdecimal()):
            return None
        length = int(text)
        if length > MAX_PICTURE_BYTES:
            raise Malformed(f"a picture of {length} bytes")
        return length

    def _size(self) -> int | None:
        """Size of the first picture in the buffer if it is complete."""
        if self._length is not None:
            return self._length if len(self._bytes) >= self._length else None
        try:
            return self._end.find(self._bytes)
        except NotJpeg as error:
            raise Malformed(str(error)) from None
