"""Which tower to link to: the one that served last, and which others there are. No I/O.

The list comes from the tower and is kept across restarts (onboard_agent.link.tower_file). The configured address always
stays in it. An address of the list counts only if it is as safe as the configured one.
"""

import random
from collections.abc import Callable, Sequence

from onboard_agent.link.tower_url import TowerUrl, parse_tower_url
from onboard_agent.unusable import Unusable
from wire.tower_list import MAX_TOWERS


class TowerChoice:
    """`configured`: the address on the command line. `kept`: the list of an earlier process. `shuffle`: so that the
    drones of a lost tower spread over the others."""

    def __init__(
        self,
        configured: TowerUrl,
        kept: Sequence[str] = (),
        shuffle: Callable[[list[TowerUrl]], None] = random.shuffle,
    ) -> None:
        self._configured = configured
        self._shuffle = shuffle
        self._listed: list[TowerUrl] = []
        self._left: TowerUrl | None = None
        self.current = configured
        """The tower of the present link, or of the last one."""
        self.learn(kept)

    def learn(self, addresses: Sequence[str]) -> bool:
        """Takes over a list. Returns whether it differs from the last one."""
        found = [one for text in addresses[:MAX_TOWERS] if (one := self._usable(text)) is not None]
        changed = found != self._listed
        self._listed = found
        return changed

    def linked(self, url: TowerUrl) -> None:
        """There is a link to this tower."""
        self.current, self._left = url, None

    def gave_up(self) -> None:
        """The present tower is silent, or sends its drones away: it is the last to be tried."""
        self._left = self.current

    @property
    def kept(self) -> tuple[str, ...]:
        """The list for the next process."""
        return tuple(str(one) for one in self._listed)

    def others(self) -> list[TowerUrl]:
        """All towers but the present one."""
        # Two names of one tower: the list has its own, the command line perhaps that of a proxy.
        found = [one for one in dict.fromkeys([*self._listed, self._configured]) if one != self.current]
        self._shuffle(found)
        return found

    def in_order(self) -> list[TowerUrl]:
        """All towers, in the order in which to try them."""
        others = self.others()
        return [*others, self.current] if self._left == self.current else [self.current, *others]

    def _usable(self, text: str) -> TowerUrl | None:
        try:
            url = parse_tower_url(text)
        except Unusable:
            return None
        return url if url.secure or not self._configured.secure else None
