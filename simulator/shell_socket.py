"""The terminals at running vehicles: a Unix socket that only its user can open. Contains no command.

Lines of text both ways. A terminal that does not read is cut off, and waits for nobody.
"""

from __future__ import annotations

import asyncio
import os
import socket
import stat
import time
from collections.abc import Sequence
from pathlib import Path
from typing import cast

from simulator.firmware.command_set import MAX_LINE
from simulator.vehicle import Vehicle
from simulator.vehicle_shell import VehicleShell

MAX_TERMINALS = 4
UNSENT_MAX = 64 * 1024
"""Bytes that a terminal may leave unread."""
MAX_UNFINISHED = 4 * MAX_LINE
LISTEN_BACKLOG = MAX_TERMINALS


class ShellSocket:
    """Opened by `open`; `step` carries what the vehicles say to the terminals."""

    def __init__(self, path: Path, vehicles: Sequence[Vehicle]) -> None:
        self._path = path
        self._vehicles = vehicles
        self._server: asyncio.Server | None = None
        self._terminals: list[_Terminal] = []

    async def open(self) -> None:
        """Raises OSError, also if another process listens there."""
        listener = _listen(self._path)
        loop = asyncio.get_running_loop()
        self._server = await loop.create_unix_server(lambda: _Terminal(self._vehicles, self._terminals), sock=listener)

    def step(self) -> None:
        for vehicle in self._vehicles:
            texts = list(vehicle.said)
            vehicle.said.clear()
            for terminal in self._terminals:
                if terminal.shell.vehicle is vehicle:
                    terminal.tell([f"[{vehicle.flight.now_s:.2f}] {text}" for text in texts])
        for terminal in list(self._terminals):
            terminal.tell(terminal.shell.step())

    def close(self) -> None:
        if self._server is not None:
            self._server.close()
            self._path.unlink(missing_ok=True)
        for terminal in list(self._terminals):
            terminal.cut()


class _Terminal(asyncio.Protocol):
    def __init__(self, vehicles: Sequence[Vehicle], others: list[_Terminal]) -> None:
        self.shell = VehicleShell(vehicles, (time.monotonic, time.process_time))
        self._others = others
        self._unfinished = b""
        self._transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)
        if len(self._others) >= MAX_TERMINALS:
            self._transport.write(b"refused: too many terminals\n")
            self._transport.close()
            return
        self._others.append(self)
        self.tell(["help lists the commands"])

    def connection_lost(self, exc: Exception | None) -> None:
        if self in self._others:
            self._others.remove(self)

    def data_received(self, data: bytes) -> None:
        if self not in self._others:
            return
        *lines, self._unfinished = (self._unfinished + data).split(b"\n")
        self._unfinished = self._unfinished[:MAX_UNFINISHED]
        for line in lines:
            answer = self.shell.execute(line.decode("utf-8", "replace"))
            if answer:
                self.tell([answer])

    def tell(self, lines: list[str]) -> None:
        transport = self._transport
        if not lines or transport is None or transport.is_closing():
            return
        if transport.get_write_buffer_size() > UNSENT_MAX:
            self.cut()
            return
        transport.write("".join(f"{line}\n" for line in lines).encode())

    def cut(self) -> None:
        if self._transport is not None:
            self._transport.abort()


def _listen(path: Path) -> socket.socket:
    """A socket that nobody listens at any more is replaced; anything else stays. Raises OSError."""
    if path.exists():
        if not stat.S_ISSOCK(path.stat().st_mode):
            raise FileExistsError(f"{path} exists and is no socket")
        if _is_alive(path):
            raise FileExistsError(f"{path} belongs to a running process")
        path.unlink()
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    before = os.umask(0o177)  # no moment in which others could connect
    try:
        listener.bind(str(path))
        listener.listen(LISTEN_BACKLOG)
    except OSError:
        listener.close()
        raise
    finally:
        os.umask(before)
    return listener


def _is_alive(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        try:
            probe.connect(str(path))
        except OSError:
            return False
    return True
