"""A local TCP port for one inside another network namespace. Passes bytes unchanged, both ways."""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from collections.abc import Iterator
from typing import Final

from bench.namespaces import inside_namespace

CONNECT_WITHIN_S: Final = 30.0


@contextlib.contextmanager
def bridged(namespace: str, port: int) -> Iterator[int]:
    """Yields the port on our loopback. Takes one connection at a time, as a simulator's own port does."""
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        listening.listen(1)
        over = threading.Event()
        thread = threading.Thread(target=_carry, args=(listening, namespace, port, over), daemon=True)
        thread.start()
        try:
            yield int(listening.getsockname()[1])
        finally:
            over.set()
            listening.shutdown(socket.SHUT_RDWR)
            thread.join(CONNECT_WITHIN_S)


def _carry(listening: socket.socket, namespace: str, port: int, over: threading.Event) -> None:
    while not over.is_set():
        try:
            near, _ = listening.accept()
        except OSError:
            return
        with near, _connected(namespace, port) as far:
            ways = [threading.Thread(target=_pump, args=pair, daemon=True) for pair in ((near, far), (far, near))]
            for way in ways:
                way.start()
            while not over.wait(0.05) and all(way.is_alive() for way in ways):
                pass
            for end in (near, far):
                with contextlib.suppress(OSError):
                    end.shutdown(socket.SHUT_RDWR)
            for way in ways:
                way.join()


def _pump(reads: socket.socket, writes: socket.socket) -> None:
    with contextlib.suppress(OSError):
        while data := reads.recv(65536):
            writes.sendall(data)


def _connected(namespace: str, port: int) -> socket.socket:
    deadline = time.monotonic() + CONNECT_WITHIN_S
    while True:
        with inside_namespace(namespace):
            far = socket.socket()
        try:
            far.connect(("127.0.0.1", port))
        except OSError:
            far.close()
            if time.monotonic() > deadline:
                raise
            time.sleep(0.05)
        else:
            return far
