"""A connection that is accepted in a loop's last turn is closed: asyncio's own loop leaves it to a later test."""

import asyncio
import socket

from worlds.event_loop import LoopOfTests


def test_the_last_connection_is_closed() -> None:
    loop = LoopOfTests()
    accepted: list[socket.socket] = []

    class _Listener(socket.socket):
        def accept(self) -> tuple[socket.socket, object]:
            connection, address = super().accept()
            accepted.append(connection)
            loop.stop()
            return connection, address

    with _Listener() as listener, socket.socket() as client:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        loop.run_until_complete(loop.create_server(asyncio.Protocol, sock=listener))
        client.connect(listener.getsockname())
        loop.run_forever()
        assert [connection.fileno() < 0 for connection in accepted] == [False]
        for task in asyncio.all_tasks(loop):
            task.cancel()
        loop.run_until_complete(asyncio.sleep(0))
        assert [connection.fileno() < 0 for connection in accepted] == [True]
        loop.close()
