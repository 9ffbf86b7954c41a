"""The other towers of the fleet: learns of them, and opens a link there when the present one is lost or ends its work.

The asyncio shell around `onboard_agent.link.tower_choice` and `onboard_agent.link.tower_leaving`.
"""

import asyncio
import contextlib
import logging
from collections.abc import Sequence
from typing import Final

from websockets.asyncio.client import ClientConnection
from websockets.exceptions import ConnectionClosed

from onboard_agent.link.identity import Identity
from onboard_agent.link.tower_choice import TowerChoice
from onboard_agent.link.tower_file import TowerFile
from onboard_agent.link.tower_leaving import PROOF_S, TowerLeaving
from onboard_agent.link.tower_url import TowerUrl
from onboard_agent.sockets.control_channel import NoLink, OpenedChannel
from onboard_agent.sockets.data_channel import DataChannel
from onboard_agent.sockets.tower_search import HelloTurn, OpenAt, open_at_any
from wire.control_messages import ToAgent
from wire.tower_list import TowerList

_log: Final = logging.getLogger(__name__)


class Elsewhere:
    """One for an agent. `open_at`: opens a new link at one tower."""

    def __init__(self, configured: TowerUrl, identity: Identity, file: TowerFile, open_at: OpenAt) -> None:
        self._identity = identity
        self._file = file
        self._open_at = open_at
        self._choice = TowerChoice(configured, file.read() if self._may_move else ())
        self._leaving = TowerLeaving()
        self._keeping: asyncio.Task[None] | None = None

    @property
    def tower(self) -> TowerUrl:
        """The tower of the present link, or of the last one."""
        return self._choice.current

    @property
    def _may_move(self) -> bool:
        """Only an agent that signs with its own key, and knows the key of its towers, goes to an address that it was
        told: a bearer credential would be given away there."""
        return self._identity.credential is None and self._identity.tower_key is not None

    @property
    def is_known(self) -> bool:
        """Whether there is another tower."""
        return self._may_move and bool(self._choice.others())

    def linked(self, opened: OpenedChannel) -> None:
        """A new link is up."""
        self._choice.linked(opened.url)
        self._leaving = TowerLeaving()
        self._learn(opened.welcome.towers)

    def told(self, message: ToAgent) -> bool:
        """Takes a message of the control channel. Returns whether it was for this part."""
        if not isinstance(message, TowerList):
            return False
        self._learn(message.towers)
        if message.leave and self.is_known:
            _log.warning("the tower %s ends its work; looking for another one", self.tower)
            self._choice.gave_up()
            self._leaving.sent_away()
        return True

    def _learn(self, towers: Sequence[str]) -> None:
        if not self._may_move or not self._choice.learn(towers):
            return
        _log.info("towers: %s", ", ".join(self._choice.kept) or "this one alone")
        self._keeping = asyncio.create_task(asyncio.to_thread(self._file.keep, self._choice.kept))

    async def open_anywhere(self) -> OpenedChannel:
        """Opens a link where one can be had. Raises NoLink or CredentialRefused."""
        towers = self._choice.in_order() if self._may_move else [self._choice.current]
        _, opened = await open_at_any(towers, self._open_at, HelloTurn())
        return opened

    @property
    def is_sent_away(self) -> bool:
        """Whether the present tower has asked the agent to leave it."""
        return self._leaving.is_sent_away

    def wants_to_look(self, *, silent_s: float, now: float) -> bool:
        """Whether to call `look` now."""
        return self.is_known and self._leaving.wants_to_look(silent_s=silent_s, now=now)

    async def look(self, opened: OpenedChannel, data: DataChannel) -> OpenedChannel:
        """Opens a link at another tower, unless the present one is heard meanwhile. Raises NoLink."""
        leaving, loop = self._leaving, asyncio.get_running_loop()

        async def still_wanted() -> None:
            if leaving.is_sent_away:
                return
            reached_at = loop.time()
            answers = asyncio.create_task(_answers(opened.connection))
            await asyncio.sleep(PROOF_S)
            answered = answers.done() and answers.result()
            answers.cancel()
            if not leaving.may_go(heard_since_reached=answered or data.sealed.keepalive.heard_at >= reached_at):
                raise NoLink("the tower is heard again")

        try:
            url, found = await open_at_any(self._choice.others(), self._open_at, HelloTurn(still_wanted))
        except NoLink:
            leaving.failed(loop.time())
            raise
        _log.warning("the tower %s %s; going on at %s", self.tower, _why(leaving), url)
        return found


def _why(leaving: TowerLeaving) -> str:
    return "ends its work" if leaving.is_sent_away else "is silent"


async def _answers(connection: ClientConnection) -> bool:
    with contextlib.suppress(ConnectionClosed):
        await (await connection.ping())
        return True
    return False
