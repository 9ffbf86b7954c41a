"""`tower-sim shell --attach PATH`: this terminal at a running tower-sim's shell. Copies bytes both ways."""

from __future__ import annotations

import contextlib
import os
import select
import socket
import sys
from pathlib import Path
from typing import BinaryIO

CHUNK = 4096
LAST_ANSWER_S = 1.0
"""How long it waits for more, after the end of its input."""


def attach(path: Path, *, source: BinaryIO | None = None, sink: BinaryIO | None = None) -> None:
    """Runs until the other end closes, or until the input has ended and its last answer came. Raises OSError."""
    source, sink = source or sys.stdin.buffer, sink or sys.stdout.buffer
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as line:
        line.connect(str(path))
        read_from: list[socket.socket | BinaryIO] = [line, source]
        while True:
            ready, _, _ = select.select(read_from, [], [], None if source in read_from else LAST_ANSWER_S)
            if not ready:
                return
            if line in ready:
                with contextlib.suppress(ConnectionResetError):
                    if data := line.recv(CHUNK):
                        sink.write(data)
                        sink.flush()
                        continue
                return
            words = os.read(source.fileno(), CHUNK)
            if words:
                line.sendall(words)
            else:
                read_from.remove(source)
