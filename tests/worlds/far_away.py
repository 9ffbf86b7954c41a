"""A TCP proxy between a browser and the tower that delays every byte.

Runs in its own thread, for synchronous tests. A connection costs a round trip before its first byte, as a real one
does. `cut` simulates a network that fails silently: connections stay open and nothing arrives.
"""

import asyncio
import contextlib
import threading
from collections.abc import Iterator
from contextlib import contextmanager


class FarAway:
    def __init__(self, port: int, one_way_s: float) -> None:
        self.port = 0
        """Port for the browser to connect to."""
        self._tower_port = port
        self._one_way_s = one_way_s
        self._loop = asyncio.new_event_loop()
        self._listening = threading.Event()
        self._open = asyncio.Event()
        self._writers: set[asyncio.StreamWriter] = set()

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def cut(self) -> None:
        self._loop.call_soon_threadsafe(self._open.clear)

    def mend(self) -> None:
        """Restores the network. Data in transit is lost and all connections close, as after a change of network."""
        self._loop.call_soon_threadsafe(self._mend)

    def _mend(self) -> None:
        for writer in self._writers:
            writer.transport.abort()
        self._open.set()

    def run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._open.set()
        server = self._loop.run_until_complete(asyncio.start_server(self._carry, "127.0.0.1", 0))
        self.port = server.sockets[0].getsockname()[1]
        self._listening.set()
        self._loop.run_forever()
        server.close()
        carrying = asyncio.all_tasks(self._loop)
        for task in carrying:
            task.cancel()
        self._loop.run_until_complete(asyncio.gather(*carrying, return_exceptions=True))
        self._loop.close()

    def wait_until_listening(self) -> None:
        assert self._listening.wait(10)

    def stop(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)

    async def _carry(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._writers.add(writer)
        try:
            await asyncio.sleep(2 * self._one_way_s)
            on_reader, on_writer = await asyncio.open_connection("127.0.0.1", self._tower_port)
            self._writers.add(on_writer)
            try:
                ways = (self._pump(reader, on_writer), self._pump(on_reader, writer))
                tasks = [asyncio.create_task(way) for way in ways]
                await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
                for task in tasks:
                    task.cancel()
            finally:
                self._writers.discard(on_writer)
                on_writer.transport.abort()
        except OSError:
            pass  # the tower is down, so close this connection too
        finally:
            self._writers.discard(writer)
            writer.transport.abort()

    async def _pump(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        under_way: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue()

        async def arrive() -> None:
            while True:
                due, data = await under_way.get()
                await asyncio.sleep(due - self._loop.time())
                await self._open.wait()
                if not data:
                    return
                writer.write(data)
                await writer.drain()

        arriving = asyncio.create_task(arrive())
        try:
            with contextlib.suppress(OSError):
                while data := await reader.read(64 * 1024):
                    under_way.put_nowait((self._loop.time() + self._one_way_s, data))
            under_way.put_nowait((self._loop.time() + self._one_way_s, b""))
            with contextlib.suppress(OSError):
                await arriving
        finally:
            arriving.cancel()


@contextmanager
def far_away(port: int, *, one_way_s: float) -> Iterator[FarAway]:
    box = FarAway(port, one_way_s)
    thread = threading.Thread(target=box.run, name="far-away")
    thread.start()
    box.wait_until_listening()
    try:
        yield box
    finally:
        box.stop()
        thread.join(10)
