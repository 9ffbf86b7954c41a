"""What a connection may keep in the kernel before and after its sign-in."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable
from dataclasses import replace
from typing import Final

import pytest
import uvloop

from server.anonymous.api.acceptor import Acceptor
from server.anonymous.core.budget import AnonymousBudget
from server.anonymous.core.connections import AnonymousConnection
from server.anonymous.core.limits import LIMITS

ANONYMOUS_BYTES: Final = 8 * 1024
ADMITTED_BYTES: Final = 128 * 1024
"""Within what every kernel allows (net.core.rmem_max)."""


def test_a_connection_gets_a_large_receive_buffer_only_after_sign_in() -> None:
    """Kernels report twice what was set: half of it is for their own records."""

    async def flow() -> None:
        limits = replace(LIMITS, receive_buffer_bytes=ANONYMOUS_BYTES, admitted_receive_buffer_bytes=ADMITTED_BYTES)
        budget = AnonymousBudget(now=0.0, limits=limits)
        accepted: asyncio.Future[tuple[AnonymousConnection, Callable[[], int]]] = (
            asyncio.get_running_loop().create_future()
        )

        class Connection(asyncio.Protocol):
            def __init__(self, anonymous: AnonymousConnection) -> None:
                self._anonymous = anonymous

            def connection_made(self, transport: asyncio.BaseTransport) -> None:
                opened = transport.get_extra_info("socket")
                accepted.set_result((self._anonymous, lambda: opened.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)))

        with socket.create_server(("127.0.0.1", 0)) as listener:
            acceptor = Acceptor(listener, budget, Connection)
            _, writer = await asyncio.open_connection(*listener.getsockname())
            anonymous, receive_buffer = await asyncio.wait_for(accepted, 30)

            assert receive_buffer() == 2 * ANONYMOUS_BYTES
            budget.connections.admit(anonymous)
            assert receive_buffer() == 2 * ADMITTED_BYTES

            writer.close()
            acceptor.close()

    with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
        runner.run(flow())


@pytest.mark.parametrize("new_loop", [asyncio.new_event_loop, uvloop.new_event_loop])
def test_a_connection_that_is_not_set_up_yet_is_closed_with_the_acceptor(
    new_loop: Callable[[], asyncio.AbstractEventLoop],
) -> None:
    budget = AnonymousBudget(now=0.0)

    async def flow(listener: socket.socket) -> socket.socket:
        acceptor = Acceptor(listener, budget, lambda _: asyncio.Protocol())
        client = socket.create_connection(listener.getsockname(), timeout=30)
        while not len(budget.connections):  # noqa: ASYNC110 (one turn later it would be set up)
            await asyncio.sleep(0)
        acceptor.close()
        await asyncio.sleep(0.01)
        return client

    with socket.create_server(("127.0.0.1", 0)) as listener, asyncio.Runner(loop_factory=new_loop) as runner:
        client = runner.run(flow(listener))
    with client:
        assert client.recv(1) == b""
    assert len(budget.connections) == 0
