"""Opens a link at the first of several towers that answers. `onboard_agent.link.tower_choice` has the order.

Attempts run side by side, because a dead machine answers nothing and a frozen tower accepts connections. Only one may
say hello at a time, and none after one that succeeded: a drone that signed in twice would lose its first link again.
"""

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from types import TracebackType
from typing import Final, Protocol

from onboard_agent.link.tower_url import TowerUrl
from onboard_agent.sockets.control_channel import CredentialRefused, NoLink, OpenedChannel

NEXT_TOWER_AFTER_S: Final = 0.3
"""The next tower is tried this long after the last one, which continues, or when that has failed."""


class HelloTurn:
    """An asynchronous context for the hello of one attempt among several. `still_wanted`: awaited before the hello;
    raises NoLink if there must not be one."""

    def __init__(self, still_wanted: Callable[[], Awaitable[None]] | None = None) -> None:
        self._lock = asyncio.Lock()
        self._still_wanted = still_wanted
        self._done = False

    async def __aenter__(self) -> None:
        await self._lock.acquire()
        try:
            if self._done:
                raise NoLink("another tower was faster")
            if self._still_wanted is not None:
                await self._still_wanted()
        except BaseException:
            self._lock.release()
            raise

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._done = self._done or kind is None
        self._lock.release()


class OpenAt(Protocol):
    """Opens a link at one tower. Raises NoLink or CredentialRefused."""

    def __call__(self, url: TowerUrl, turn: HelloTurn) -> Awaitable[OpenedChannel]: ...


async def open_at_any(towers: Sequence[TowerUrl], open_at: OpenAt, turn: HelloTurn) -> tuple[TowerUrl, OpenedChannel]:
    """Raises the failure of the first tower, or NoLink if not all have refused the drone."""
    left = list(towers)
    trying: dict[asyncio.Future[OpenedChannel], TowerUrl] = {}
    failed: dict[TowerUrl, NoLink] = {}
    try:
        while left or trying:
            if left:
                url = left.pop(0)
                trying[asyncio.ensure_future(open_at(url, turn))] = url
            done, _ = await asyncio.wait(
                trying, timeout=NEXT_TOWER_AFTER_S if left else None, return_when=asyncio.FIRST_COMPLETED
            )
            for one in done:
                url = trying.pop(one)
                try:
                    return url, one.result()
                except NoLink as error:
                    failed[url] = error
    finally:
        for one in trying:
            one.cancel()
        await asyncio.gather(*trying, return_exceptions=True)
    reasons = [failed[url] for url in towers if url in failed] or [NoLink("there is no tower to try")]
    unreached = next((one for one in reasons if not isinstance(one, CredentialRefused)), None)
    raise unreached or reasons[0]
