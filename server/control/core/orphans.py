"""Links without a control channel whose datagrams still arrive. No I/O; takes `now`.

Such a link lives on for a while: its pilot flies on, and its agent, which notices the same, opens another control
channel (wire.resuming). docs/control.md lists what an orphan cannot receive in the meantime.
"""

from collections.abc import Callable
from typing import Final

from server.link.core.agent_link import AgentLink
from server.link.core.agent_routes import OVER_CHANNEL
from wire.ids import LinkId

ORPHAN_S: Final = 10.0
"""A new control channel takes a second or two. An agent that has none after this cannot have one."""

SILENT_S: Final = 1.5
"""Three keep-alives in a row are missing (a rest before them is left out): the data channel went with the control
channel, and there is no link."""


def outlives_its_channel(link: AgentLink, now: float) -> bool:
    """Whether a link has more than its control channel. One whose datagrams travel on that channel has not."""
    return (
        link.resume_key != b""
        and link.routes.newest not in (None, OVER_CHANNEL)
        and link.sealed.keepalive.silent_for(now) <= SILENT_S + link.sealed.keepalive.rests_s
        and not link.sealed.keys_outlived(now)
    )


class Orphans:
    """One for the hub. `end`: called with a link whose time is over."""

    def __init__(self, end: Callable[[AgentLink], None]) -> None:
        self._end = end
        self._links: dict[LinkId, tuple[AgentLink, float]] = {}

    def __len__(self) -> int:
        return len(self._links)

    def take(self, link: AgentLink, now: float) -> bool:
        """The control channel is gone. False if the link ends with it."""
        if not outlives_its_channel(link, now):
            return False
        link.forget_channel()
        self._links[link.link_id] = link, now + ORPHAN_S
        return True

    def forget(self, link: AgentLink) -> None:
        """It has a control channel again, or has ended."""
        self._links.pop(link.link_id, None)

    def tick(self, now: float) -> None:
        """Called several times a second: repeats unanswered orders and ends links whose time is over."""
        for link, until in list(self._links.values()):
            if now >= until or not outlives_its_channel(link, now):
                self._end(link)
            else:
                link.repeat_orders()
