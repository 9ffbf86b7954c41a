"""Separate sockets for some peers on one UDP port: which socket receives from which peer, and that the port stays
ours."""

import asyncio
import socket
from collections.abc import Iterator

import pytest

from server.link.api.connected_sockets import ConnectedSockets


def udp(*, bound: bool = True) -> socket.socket:
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    opened.setblocking(False)
    if bound:
        opened.bind(("127.0.0.1", 0))
    return opened


class Port:
    """A port with a shared socket, and two peers that send to it."""

    def __init__(self) -> None:
        self.shared, self.near, self.far = udp(), udp(), udp()
        self.read: list[bytes] = []
        self.came = asyncio.Event()
        self.connected = ConnectedSockets(self.shared, self._read)

    def _read(self, ready: socket.socket) -> None:
        while True:
            try:
                self.read.append(ready.recv(2048))
            except OSError:
                return
            self.came.set()

    def send(self, peer: socket.socket, text: bytes) -> None:
        peer.sendto(text, self.shared.getsockname())

    def shared_has(self) -> list[bytes]:
        had = []
        while True:
            try:
                had.append(self.shared.recv(2048))
            except OSError:
                return had

    def close(self) -> None:
        self.connected.close()
        for one in (self.shared, self.near, self.far):
            one.close()


@pytest.fixture
async def port() -> Iterator[Port]:  # type: ignore[misc]
    one = Port()
    yield one
    one.close()


async def test_a_peer_that_is_followed_is_read_at_once_and_the_others_wait_in_the_shared_socket(port: Port) -> None:
    assert port.connected.follow({port.near.getsockname()})
    port.send(port.far, b"far")
    port.send(port.near, b"near")
    await asyncio.wait_for(port.came.wait(), 30)
    assert port.read == [b"near"]
    assert port.shared_has() == [b"far"]


async def test_who_is_followed_no_longer_comes_by_the_shared_socket_again_and_nothing_is_lost(port: Port) -> None:
    port.connected.follow({port.near.getsockname()})
    port.send(port.near, b"first")
    port.connected.follow(set())
    port.send(port.near, b"second")
    assert port.read == [b"first"]
    assert port.shared_has() == [b"second"]
    assert len(port.connected) == 0


async def test_nobody_else_gets_the_port_while_peers_are_followed(port: Port) -> None:
    port.connected.follow({port.near.getsockname()})
    with udp(bound=False) as thief:
        thief.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        with pytest.raises(OSError, match="in use"):
            thief.bind(port.shared.getsockname())


async def test_who_cannot_be_connected_is_said_and_comes_by_the_shared_socket(port: Port) -> None:
    assert not port.connected.follow({("::1", 9), port.near.getsockname()})  # of the other address family
    assert len(port.connected) == 1
    assert port.connected.follow({port.near.getsockname()})
