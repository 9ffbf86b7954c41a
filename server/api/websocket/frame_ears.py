"""Hears a client's WebSocket frames before the parser does: those that are whole messages, of the kinds wanted. Pure.

The parser, a queue and a task cost a message some hundred microseconds, which is nothing for a request and much for
fifty viewers that say of each picture that they have drawn it. Here a message costs a few. All that is not wanted goes
to the parser as it came, in order, whole frames and the beginnings of frames alike (RFC 6455, 5.2).
"""

from collections.abc import Callable
from typing import Final

try:
    from websockets.speedups import apply_mask
except ImportError:
    from websockets.utils import apply_mask

Listener = Callable[[bytes], None]

_TEXT: Final = 0x81
_BINARY: Final = 0x82
"""Whole messages in one frame."""
_MASKED: Final = 0x80
_MASK_BYTES: Final = 4
_MIN_HEAD_BYTES: Final = 6
MAX_TEXT_BYTES: Final = 125
MAX_READ_BYTES: Final = 4 * 1024
"""Texts that come in larger lumps are no business of these ears: the parser takes them in slices."""


class FrameEars:
    """`parse`: takes what is not heard here. `parser_is_busy`: it has something that came before, and is to have what
    comes now as well.

    `on_text`: each text message of up to MAX_TEXT_BYTES, which may be something else than UTF-8. `on_binary`: each
    binary message of up to `largest_binary` bytes.
    """

    def __init__(
        self,
        parse: Listener,
        parser_is_busy: Callable[[], bool],
        *,
        on_text: Listener | None = None,
        on_binary: Listener | None = None,
        largest_binary: int = 0,
    ) -> None:
        self._parse = parse
        self._parser_is_busy = parser_is_busy
        self._on_text = on_text
        self._on_binary = on_binary
        self._largest_binary = largest_binary
        self._cut = b""
        """The beginning of a head."""
        self._left = 0
        """Bytes of a frame that are still to come."""
        self._parts: list[bytes] | None = None
        """Of it, if it is heard here, as they came; None: they go to the parser."""
        self._mask = b""
        self._deaf = False

    def hear(self, data: bytes) -> None:
        """Something came."""
        if self._deaf:
            self._parse(data)
            return
        if self._cut:
            data, self._cut = self._cut + data, b""
        if self._on_binary is None and len(data) > MAX_READ_BYTES and not self._left:
            self._give_up(data)
            return
        at = 0
        while at < len(data) and not self._deaf:
            at = self._go_on(data, at) if self._left else self._begin(data, at)

    def _go_on(self, data: bytes, at: int) -> int:
        end = min(at + self._left, len(data))
        self._left -= end - at
        part = data[at:end]
        if self._parts is None:
            self._parse(part)
        else:
            self._parts.append(part)
            if not self._left:
                whole = part if len(self._parts) == 1 else b"".join(self._parts)
                self._parts = None
                if self._on_binary is not None:
                    self._on_binary(apply_mask(whole, self._mask))
        return end

    def _begin(self, data: bytes, at: int) -> int:
        have, first = len(data) - at, data[at]
        if have < _MIN_HEAD_BYTES:
            self._cut = data[at:]
            return len(data)
        second = data[at + 1]
        length = second & 0x7F
        if first == _TEXT and length <= MAX_TEXT_BYTES and second & _MASKED and self._on_text is not None:
            end = at + _MIN_HEAD_BYTES + length
            if end <= len(data) and not self._parser_is_busy():
                self._on_text(apply_mask(data[at + _MIN_HEAD_BYTES : end], data[at + 2 : at + _MIN_HEAD_BYTES]))
                return end
        more = 2 if length == 126 else 8 if length == 127 else 0
        mask = _MASK_BYTES if second & _MASKED else 0
        head = 2 + more + mask
        if have < head:
            self._cut = data[at:]
            return len(data)
        if more:
            length = int.from_bytes(data[at + 2 : at + 2 + more])
        heard = first == _BINARY and mask and self._on_binary is not None and 0 < length <= self._largest_binary
        if heard and not self._parser_is_busy():
            self._parts, self._left = [], length
            self._mask = data[at + 2 + more : at + head]
            return at + head
        if self._on_binary is not None and length > self._largest_binary:
            self._give_up(data[at:])  # the parser says that it is too large
            return len(data)
        self._left = head + length
        return at

    def _give_up(self, data: bytes) -> None:
        self._deaf = True
        self._parse(data)
