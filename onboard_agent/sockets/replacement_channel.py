"""Watches one control channel of a link, and opens the one that replaces it, at this tower or at another one.

A thin shell around `onboard_agent.link.channel_replacement`.
"""

import asyncio
import logging
from collections.abc import Awaitable, Callable, Sequence
from typing import Final

from onboard_agent.link.backoff import Backoff
from onboard_agent.link.channel_replacement import ChannelReplacement, Need
from onboard_agent.sockets.control_channel import NoLink, OpenedChannel
from onboard_agent.sockets.data_channel import DataChannel
from onboard_agent.sockets.elsewhere import Elsewhere

_log = logging.getLogger(__name__)

CHECK_EVERY_S: Final = 0.1
STAYS_S: Final = 1.0
"""A tower that sends its drones away closes their links once another one has them in the database. Until then, but not
for longer, sticks still come through it. Far less than the other tower believes its word that all is well (4 s)."""

OpenAnother = Callable[[OpenedChannel, Sequence[str]], Awaitable[OpenedChannel]]
"""Opens a control channel for the link of the given one, over the first of these uplinks that leads to the tower."""


async def successor(
    opened: OpenedChannel,
    data: DataChannel,
    reading: asyncio.Task[None],
    open_another: OpenAnother,
    elsewhere: Elsewhere,
) -> OpenedChannel | None:
    """Waits for the next control channel and returns it: of the same link, or of a new one if the tower decides so.
    Returns None if the link has ended. `reading`: done when the control channel `opened` has ended."""
    loop = asyncio.get_running_loop()
    succession = ChannelReplacement(Backoff(), loop.time())
    local_address = str(opened.connection.local_address[0])
    ended = False
    moved: OpenedChannel | None = None
    following: OpenedChannel | None = None
    leaves_at = 0.0
    attempt: asyncio.Task[OpenedChannel] | None = None
    look: asyncio.Task[OpenedChannel] | None = None
    try:
        while True:
            now = loop.time()
            if moved is not None and (reading.done() or now >= leaves_at):
                following, moved = moved, None
                return following
            if reading.done() and not ended:
                ended = True
                succession.ended(opened.connection.close_code, now)
            if attempt is not None and attempt.done():
                try:
                    return attempt.result()
                except NoLink as error:
                    _log.info("no other control channel yet: %s", error)
                    attempt = None
                    succession.failed(now)
            if look is not None and look.done():
                try:
                    found = look.result()
                except NoLink as error:
                    _log.info("no other tower: %s", error)
                else:
                    if not elsewhere.is_sent_away or ended:
                        return found
                    moved, leaves_at = found, now + STAYS_S
                look = None
            if look is None and moved is None and elsewhere.wants_to_look(silent_s=data.silent_s(now), now=now):
                look = asyncio.create_task(elsewhere.look(opened, data))
            need = succession.need(
                silent_s=data.silent_s(now),
                over_udp=data.over_udp,
                uplink_silent=data.is_cut_off(local_address, now),
                others=elsewhere.is_known,
                now=now,
            )
            if need is Need.END:
                following, moved = moved, None
                return following
            if need is Need.ANOTHER and attempt is None and moved is None:
                _log.warning("the control channel %s; opening another", "is lost" if ended else "is cut off")
                attempt = asyncio.ensure_future(open_another(opened, data.uplinks_that_work(now)))
            if moved is not None and reading.done():
                continue
            waiting = [one for one in (reading, attempt, look) if one is not None and not one.done()]
            if waiting:
                await asyncio.wait(waiting, timeout=CHECK_EVERY_S, return_when=asyncio.FIRST_COMPLETED)
            else:
                await asyncio.sleep(CHECK_EVERY_S)
    finally:
        if moved is not None:
            moved.connection.transport.abort()
        pending = [one for one in (attempt, look) if one is not None]
        for one in pending:
            one.cancel()
        await asyncio.gather(*pending, return_exceptions=True)
