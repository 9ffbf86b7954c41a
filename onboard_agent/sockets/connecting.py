"""A TCP connection to the tower over the uplink that connects first. A thin shell.

If there are several routes (several uplinks, several addresses of the name), each is tried a quarter of a second after
the previous one, which continues (as in RFC 8305). A dead uplink costs no more than that.
"""

import asyncio
import ipaddress
import socket
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

from onboard_agent.link.tower_url import TowerUrl
from onboard_agent.sockets.data_socket import bind_to_uplink

RESOLVE_WITHIN_S: Final = 2.0
CONNECT_WITHIN_S: Final = 2.0
NEXT_WAY_AFTER_S: Final = 0.25
UNSENT_BYTES: Final = 8192
"""Maximum unsent bytes in the kernel (TCP_NOTSENT_LOWAT). Datagrams use this connection if UDP is blocked, and must
wait where the agent can still drop them."""


class Unreachable(Exception):
    """No route leads to the tower. The message gives the reason for a person."""


class _Way(NamedTuple):
    uplink: str
    family: int
    address: Any
    """As getaddrinfo returns it."""


async def connect_tcp(url: TowerUrl, uplinks: Sequence[str], host: str | None = None) -> socket.socket:
    """Returns a connected, non-blocking socket. Without TLS it tries only loopback addresses. Raises Unreachable.

    `uplinks`: as in `DataSocket`, the best first. `host`: the address, if it is already known, because a name might be
    resolved over the dead uplink.
    """
    loop = asyncio.get_running_loop()
    try:
        async with asyncio.timeout(RESOLVE_WITHIN_S):
            found = await loop.getaddrinfo(host or url.host, url.port, type=socket.SOCK_STREAM)
    except (OSError, TimeoutError):
        raise Unreachable(f"the name {url.host} cannot be resolved") from None
    ways = [
        _Way(uplink, family, address)
        for uplink in uplinks
        for family, _, _, _, address in found
        if url.secure or ipaddress.ip_address(address[0]).is_loopback
    ]
    if not ways:
        raise Unreachable(f"{url} cannot be reached: its name has no address that may be used")
    return await _first_of(url, ways)


async def _first_of(url: TowerUrl, ways: Sequence[_Way]) -> socket.socket:
    trying: set[asyncio.Task[socket.socket]] = set()
    reason = ""
    left = list(ways)
    try:
        while left or trying:
            if left:
                trying.add(asyncio.create_task(_connect(left.pop(0))))
            done, trying = await asyncio.wait(
                trying, timeout=NEXT_WAY_AFTER_S if left else None, return_when=asyncio.FIRST_COMPLETED
            )
            for task in done:
                error = task.exception()
                if error is None:
                    trying |= done - {task}  # two connected at once: the other is closed below
                    return task.result()
                reason = _in_words(error)
    finally:
        for task in trying:
            task.cancel()
        for ended in await asyncio.gather(*trying, return_exceptions=True):
            if isinstance(ended, socket.socket):
                ended.close()
    raise Unreachable(f"{url} cannot be reached: {reason}")


async def _connect(way: _Way) -> socket.socket:
    opened = socket.socket(way.family, socket.SOCK_STREAM)
    try:
        opened.setblocking(False)
        if way.uplink:
            bind_to_uplink(opened, way.uplink)
        async with asyncio.timeout(CONNECT_WITHIN_S):
            await asyncio.get_running_loop().sock_connect(opened, way.address)
        opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, UNSENT_BYTES)
    except BaseException:
        opened.close()
        raise
    return opened


def _in_words(error: BaseException) -> str:
    if isinstance(error, TimeoutError):
        return "no answer"
    if isinstance(error, OSError):
        return error.strerror or str(error)
    raise error
