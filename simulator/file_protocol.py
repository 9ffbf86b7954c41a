"""The server half of MAVLink FTP, read-only: list, open, read, burst, checksum, close.

ArduPilot's parameter file is generated for the block size that the client requests; other files are served unchanged.

A burst is sent in parts, one part a tick, and ends after 2,000 blocks as ArduPilot's. Requests wait for its end.

One session serves all clients. While it is open, requests for another session are refused until it has been silent for
a while.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Iterator, Sequence, Set

from simulator.dialect import Message, mavlink
from simulator.failure_modes import Failure
from simulator.metadata import mavlink_crc32
from simulator.parameter_pack import pack_parameters
from simulator.parameters import Parameters

HEAD = struct.Struct("<HBBBBBxI")
BLOCK_MAX = 239
PAYLOAD = HEAD.size + BLOCK_MAX
WAITING_MAX = 5
"""Queued requests; further ones are lost."""
SESSION_SILENT_S = 3.0
ENTRY_USUAL = 12
"""Bytes; the reported file length is an estimate."""

BURST_BLOCKS = 2000
BURST_BLOCKS_A_TICK = 10

TERMINATE, RESET, LIST, OPEN_TO_READ, READ, CHECKSUM, BURST = 1, 2, 3, 4, 5, 14, 15
ACK, NACK = 128, 129
FAIL, INVALID_SIZE, INVALID_SESSION, END_OF_FILE, NOT_FOUND = 1, 3, 4, 6, 10

Peer = tuple[int, int]


class FileServer:
    def __init__(
        self,
        parameters: Parameters,
        send: Callable[[Message], None],
        *,
        packs_parameters: bool = True,
        file: Callable[[bytes], bytes | None] = lambda _name: None,
        entries: Callable[[bytes], Sequence[bytes] | None] = lambda _directory: None,
    ) -> None:
        """`packs_parameters`: serves ArduPilot's parameter file. `file`: returns any other file by its name, if it
        exists. `entries`: those of a directory, if it exists."""
        self._parameters = parameters
        self._send = send
        self._packs_parameters = packs_parameters
        self._file = file
        self._entries = entries
        self._bursting: Iterator[None] = iter(())
        self._waiting: deque[tuple[bytes, Peer]] = deque()
        self._session: int | None = None
        self._block = 0
        """Block size of the first read of the parameter file, which the session keeps. 0: any."""
        self._content: bytes | None = None
        self._heard_at = float("-inf")
        self._now_s = 0.0
        self._answers = 0
        self._last: tuple[Peer, int, int, bytes] | None = None
        """Peer, session and sequence of the last response, and the response."""
        self.refuses = False
        self.drop_every_seventh = False

    def receive(self, message: Message, peer: Peer) -> None:
        if len(self._waiting) < WAITING_MAX:
            self._waiting.append((bytes(message.payload).ljust(PAYLOAD, b"\0"), peer))

    def suffer(self, failures: Set[Failure]) -> None:
        self.refuses = Failure.FILES_REFUSED in failures
        self.drop_every_seventh = Failure.FILES_DROPPED in failures

    def tick(self, now_s: float) -> None:
        self._now_s = now_s
        while True:
            for _ in self._bursting:
                self._heard_at = now_s
                return
            if not self._waiting:
                return
            self._do(*self._waiting.popleft())

    def _do(self, payload: bytes, peer: Peer) -> None:
        sequence, session, op, size, _, _, offset = HEAD.unpack_from(payload)
        if self._last is not None and self._last[:3] == (peer, session, sequence + 1 & 0xFFFF):
            self._put(peer, self._last[3])
            return

        def answer(kind: int, data: bytes = b"", at: int = 0, *, more: int = 0, done: bool = False) -> None:
            number = sequence + 1 + more & 0xFFFF
            head = HEAD.pack(number, session, kind, len(data), op, done, at)
            out = (head + data).ljust(PAYLOAD, b"\0")
            self._last = (peer, session, number, out)
            self._put(peer, out)

        silent = self._now_s - self._heard_at >= SESSION_SILENT_S
        if self._session is not None and session != self._session and silent:
            self._session = None
        if op in (TERMINATE, RESET):
            if session == self._session:
                self._session = None
            answer(ACK)
        elif self._session is not None and session != self._session:
            answer(NACK, bytes([INVALID_SESSION]))
        elif op in (LIST, CHECKSUM):
            name = payload[HEAD.size :][:size].split(b"\0")[0]
            answer(*(self._list(name, offset) if op == LIST else self._checksum(name)))
        elif op == OPEN_TO_READ:
            self._open(session, payload[HEAD.size :][:size], answer)
        elif op in (READ, BURST) and self._session is None:
            answer(NACK, bytes([NOT_FOUND]))
        elif op == READ:
            data = self._read(offset, size)
            answer(*((ACK, data, offset) if data else (NACK, bytes([END_OF_FILE]))))
        elif op == BURST:
            self._bursting = self._burst(offset, size or BLOCK_MAX, answer)
        else:
            answer(NACK, bytes([FAIL]))
        self._heard_at = self._now_s

    def _open(self, session: int, name: bytes, answer: Callable[..., None]) -> None:
        name = name.split(b"\0")[0]
        packed = self._packs_parameters and name.split(b"?")[0] == b"@PARAM/param.pck"
        content = None if packed else self._file(name)
        if self._session is not None or self.refuses:
            answer(NACK, bytes([FAIL]))
        elif not packed and content is None:
            answer(NACK, bytes([NOT_FOUND]))
        else:
            self._session, self._content, self._block = session, content, 0
            size = ENTRY_USUAL * len(self._parameters) if content is None else len(content)
            answer(ACK, struct.pack("<I", size))

    def _read(self, offset: int, size: int) -> bytes:
        if self._content is None:
            self._block = size
            self._content = pack_parameters(self._parameters, max(size, 1))
        return self._content[offset : offset + size] if self._block in (0, size) else b""

    def _burst(self, offset: int, size: int, answer: Callable[..., None]) -> Iterator[None]:
        """Yields after each part."""
        for more in range(BURST_BLOCKS):
            data = self._read(offset, size)
            if not data:
                answer(NACK, bytes([END_OF_FILE]), offset, more=more)
                return
            answer(ACK, data, offset, more=more, done=len(data) < size or more == BURST_BLOCKS - 1)
            offset += len(data)
            if more % BURST_BLOCKS_A_TICK == BURST_BLOCKS_A_TICK - 1:
                yield

    def _list(self, directory: bytes, first: int) -> tuple[int, bytes]:
        entries = self._entries(directory)
        if entries is None:
            return NACK, bytes([NOT_FOUND])
        data = b""
        for entry in entries[first:]:
            if len(data) + len(entry) + 2 > BLOCK_MAX:
                break
            data += entry + b"\0\0"  # as ArduPilot does
        return (ACK, data) if data else (NACK, bytes([END_OF_FILE]))

    def _checksum(self, name: bytes) -> tuple[int, bytes]:
        content = self._file(name)
        return (NACK, bytes([NOT_FOUND])) if content is None else (ACK, struct.pack("<I", mavlink_crc32(content)))

    def _put(self, peer: Peer, payload: bytes) -> None:
        self._answers += 1
        if not (self.drop_every_seventh and self._answers % 7 == 0):
            self._send(mavlink.MAVLink_file_transfer_protocol_message(0, *peer, payload))
