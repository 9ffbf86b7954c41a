"""The shares of what people, teams and drones share: one table, with limits that an admin may change. Pure.

docs/shares.md has the same table. A part asks `limit` each time, so a change counts at once. What a part gives out over
time it notes (`note`), and what waits or is stored it counts itself.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from server.kernel.refusal import Refusal

WINDOW_S: Final = 60.0
MAX_NAMED: Final = 10_000
"""Of one share in one window. Beyond it newcomers are counted together, under NOBODY."""
NOBODY: Final = 0


class Whose(StrEnum):
    PERSON = "person"
    DRONE = "drone"
    TEAM = "team"
    TOWER = "tower"
    """All together."""


class ShareName(StrEnum):
    REQUEST_TIME = "request-time"
    WRITES = "writes"
    WORK = "long-work"
    OPERATIONS = "operations"
    RECORDINGS = "recordings"
    IMPORTS = "imports"
    ZONES = "zones"
    ZONES_OF_TEAMS = "zones-of-teams"
    ANNOUNCEMENTS = "announcements"
    DELIVERIES = "deliveries"
    ALERTS = "alerts"
    AUDIT_ROWS = "audit-rows"
    AIRCRAFT = "aircraft"


@dataclass(frozen=True, kw_only=True)
class Share:
    """`default`, `least`, `most`: of its limit. `beyond`: what happens to who asks for more. `over_time`: used in the
    last minute, and not at this moment."""

    name: ShareName
    what: str
    whose: Whose
    beyond: str
    default: int
    least: int = 1
    most: int
    over_time: bool = False


_PERSON, _DRONE, _TEAM, _TOWER = Whose.PERSON, Whose.DRONE, Whose.TEAM, Whose.TOWER

SHARES: Final[Mapping[ShareName, Share]] = {
    one.name: one
    for one in (
        Share(
            name=ShareName.REQUEST_TIME,
            what="processor time, ms; 1/30 a second",
            whose=_PERSON,
            beyond="429 `too-many-requests`",
            default=3_000,
            least=500,
            most=100_000,
            over_time=True,
        ),
        Share(
            name=ShareName.WRITES,
            what="requests that change things; a tenth a second",
            whose=_PERSON,
            beyond="429 `too-many-requests`",
            default=500,
            least=50,
            most=10_000,
            over_time=True,
        ),
        Share(
            name=ShareName.WORK,
            what="long work that waits: shapes, plans, lists of zones",
            whose=_PERSON,
            beyond="429 `too-much-work`",
            default=4,
            most=32,
        ),
        Share(
            name=ShareName.OPERATIONS,
            what="operations at drones; a tenth a second",
            whose=_PERSON,
            beyond="429 `too-many-operations`",
            default=100,
            least=10,
            most=10_000,
            over_time=True,
        ),
        Share(
            name=ShareName.RECORDINGS,
            what="recordings begun at once; one in 2 s",
            whose=_PERSON,
            beyond="429 `too-many-recordings`",
            default=50,
            most=1_000,
            over_time=True,
        ),
        Share(
            name=ShareName.IMPORTS,
            what="imported flights; one is converted at a time",
            whose=_PERSON,
            beyond="409 `imports-full`",
            default=50,
            most=500,
        ),
        Share(
            name=ShareName.ZONES,
            what="zones, also of all teams of one maker",
            whose=_TEAM,
            beyond="409 `too-many-zones`",
            default=50,
            most=250,
        ),
        Share(
            name=ShareName.ZONES_OF_TEAMS,
            what="zones of all teams; 500 with the tower's own",
            whose=_TOWER,
            beyond="409 `too-many-zones`",
            default=250,
            most=450,
        ),
        Share(
            name=ShareName.ANNOUNCEMENTS,
            what="announcements of alerts that wait",
            whose=_DRONE,
            beyond="its oldest are dropped",
            default=100,
            least=10,
            most=1_000,
        ),
        Share(
            name=ShareName.DELIVERIES,
            what="messages to channels that wait",
            whose=_DRONE,
            beyond="its newest are dropped and counted",
            default=300,
            least=10,
            most=5_000,
        ),
        Share(
            name=ShareName.ALERTS,
            what="alerts that wait to be stored",
            whose=_DRONE,
            beyond="its newest are counted, not stored",
            default=500,
            least=20,
            most=5_000,
        ),
        Share(
            name=ShareName.AUDIT_ROWS,
            what="ends of holds in the trail at once; one in 5 s",
            whose=_DRONE,
            beyond="a line in the log",
            default=60,
            least=5,
            most=1_000,
            over_time=True,
        ),
        Share(
            name=ShareName.AIRCRAFT,
            what="aircraft that its receiver on board hears",
            whose=_DRONE,
            beyond="the longest silent one goes",
            default=100,
            least=10,
            most=500,
        ),
    )
}


class BadShareLimit(Refusal):
    """A limit beyond what the tower can keep."""

    def __init__(self, share: Share) -> None:
        super().__init__(f"must be between {share.least} and {share.most}")


def check_limit(share: Share, limit: int | None) -> None:
    """None: the default. Raises BadShareLimit."""
    if limit is not None and not share.least <= limit <= share.most:
        raise BadShareLimit(share)


def read_limits(text: str) -> dict[ShareName, int]:
    """The defaults of a tower: "operations=200,zones=80". Raises ValueError in words that follow a setting's name."""
    found: dict[ShareName, int] = {}
    for part in text.split(","):
        name, equals, number = (one.strip() for one in part.partition("="))
        if name not in SHARES or not equals or not number.isascii() or not number.isdecimal():
            raise ValueError(f"must look like zones=80,operations=200, with names of {', '.join(SHARES)}")
        share = SHARES[ShareName(name)]
        if share.name in found:
            raise ValueError(f"must have {name} once")
        try:
            check_limit(share, int(number))
        except BadShareLimit:
            raise ValueError(f"must have a limit for {name} between {share.least} and {share.most}") from None
        found[share.name] = int(number)
    return found


class Shares:
    """The limits that count now, and who has used what in the last minute. One for a tower. `defaults`: of this tower,
    where they are not those of the table."""

    def __init__(self, defaults: Mapping[ShareName, int] | None = None) -> None:
        self._defaults = defaults or {}
        self._changed: Mapping[str, int] = {}
        self._now: dict[ShareName, Counter[int]] = {}
        self._before: dict[ShareName, Counter[int]] = {}
        self._began_at = float("-inf")

    def limit(self, name: ShareName) -> int:
        changed = self._changed.get(name)
        return self.default(name) if changed is None else changed

    def default(self, name: ShareName) -> int:
        """What counts until an admin chooses."""
        return self._defaults.get(name, SHARES[name].default)

    def apply(self, limits: Mapping[str, int]) -> bool:
        """What admins have chosen, as the database has it; all others have their defaults. Whether that is new."""
        if limits == self._changed:
            return False
        self._changed = dict(limits)
        return True

    def note(self, name: ShareName, whose: int, count: int = 1) -> None:
        """This person, team or drone has used so much."""
        used = self._now.get(name)
        if used is None:
            used = self._now[name] = Counter()
        used[whose if whose in used or len(used) < MAX_NAMED else NOBODY] += count

    def tick(self, now: float) -> None:
        """Once a second."""
        if now - self._began_at >= WINDOW_S:
            self._began_at = now
            self._before, self._now = self._now, {}

    def used(self, name: ShareName) -> Counter[int]:
        """Who used how much in the last whole minute and since."""
        return self._before.get(name, Counter()) + self._now.get(name, Counter())
