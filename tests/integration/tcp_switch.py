"""A port in front of several towers, as a proxy is. New connections go to the current target."""

import contextlib
import socket
import threading


class TcpSwitch:
    """Runs in its own threads."""

    def __init__(self, target: int) -> None:
        self._target = target
        self._open: list[socket.socket] = []
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def turn_to(self, target: int) -> None:
        """Redirects new connections only. Existing ones stay with their tower and end with it."""
        self._target = target

    def cut(self) -> None:
        """Ends the connections and refuses new ones, until `turn_to`."""
        self._target = 0
        self._end(self._open)
        self._open = []

    def close(self) -> None:
        self._end([self._listener, *self._open])

    @staticmethod
    def _end(sockets: list[socket.socket]) -> None:
        for one in sockets:
            with contextlib.suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
            one.close()

    def _accept(self) -> None:
        while True:
            try:
                came, _ = self._listener.accept()
            except OSError:
                return
            try:
                behind = socket.create_connection(("127.0.0.1", self._target))
            except OSError:
                came.close()
                continue
            self._open += [came, behind]
            for source, sink in ((came, behind), (behind, came)):
                threading.Thread(target=_pour, args=(source, sink), daemon=True).start()


def _pour(source: socket.socket, sink: socket.socket) -> None:
    with contextlib.suppress(OSError):
        while data := source.recv(65536):
            sink.sendall(data)
    for one in (source, sink):
        with contextlib.suppress(OSError):
            one.shutdown(socket.SHUT_RDWR)
