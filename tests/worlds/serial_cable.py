"""A serial line (pseudo-terminal) between an autopilot that listens on TCP and a program that opens a device."""

import os
import pty
import select
import socket
import threading
import time
import tty
from typing import Final

CONNECT_WITHIN_S: Final = 20.0


class SerialCable:
    """Connects `device` to the TCP port until `unplug`."""

    def __init__(self, tcp_port: int) -> None:
        self._master, self._slave = pty.openpty()
        tty.setraw(self._master)
        tty.setraw(self._slave)
        self.device = os.ttyname(self._slave)
        self._stop, self._stopped = os.pipe()
        self._thread = threading.Thread(target=self._carry, args=(tcp_port,), daemon=True)
        self._thread.start()

    def unplug(self) -> None:
        """Ends the transfer."""
        os.close(self._stopped)
        self._thread.join()
        for descriptor in (self._master, self._slave, self._stop):
            os.close(descriptor)

    def _carry(self, tcp_port: int) -> None:
        with _connected(tcp_port) as autopilot:
            while True:
                ready, _, _ = select.select([self._master, autopilot, self._stop], [], [])
                if self._stop in ready:
                    return
                if self._master in ready:
                    autopilot.sendall(os.read(self._master, 4096))
                if autopilot in ready:
                    data = autopilot.recv(1024)  # less than a terminal buffers: there may be no reader yet
                    if not data:
                        return
                    if select.select([], [self._master], [], 0)[1]:
                        os.write(self._master, data)


def _connected(tcp_port: int) -> socket.socket:
    deadline = time.monotonic() + CONNECT_WITHIN_S
    while True:
        try:
            return socket.create_connection(("127.0.0.1", tcp_port))
        except OSError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.05)
