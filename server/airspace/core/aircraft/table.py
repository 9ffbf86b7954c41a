"""The aircraft that somebody hears: bounded, with ages, and by whom. Pure; takes `now`.

Every receiver on board is a witness of its own: what it says counts for the people of its drone, and neither displaces
nor overrules what others hear. The network feed is the tower's own receiver and counts for all.
"""

from collections import OrderedDict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from server.airspace.core.aircraft.decode import Identity, Report, Threat
from server.kernel.shares import ShareName, Shares
from wire.ids import DroneId

MAX_OF_FEED: Final = 500
KEEP_S: Final = 60.0
"""An aircraft that nobody has heard for this long is forgotten."""
THREAT_S: Final = 5.0

Witness = DroneId | None
"""The drone whose receiver heard it; None: the network feed."""
Trusts = Callable[[DroneId], bool]
"""Whether what this drone's receiver hears counts for somebody."""


class Heard(NamedTuple):
    by: Witness
    report: Report


@dataclass
class Aircraft:
    """All that is said of one aircraft."""

    key: str
    reports: dict[Witness, Report] = field(default_factory=dict)
    names: dict[DroneId, str] = field(default_factory=dict)
    """Serial numbers that were heard with it."""
    threatens: dict[DroneId, tuple[Threat, float]] = field(default_factory=dict)
    """Drones whose autopilot avoids it, and since when."""
    along_since: dict[Witness, dict[DroneId, float]] = field(default_factory=dict)
    """The tower's own drones that are where each report has it, and since when."""

    def heard_for(self, trusts: Trusts) -> Heard | None:
        """The newest report that counts."""
        count = [Heard(by, one) for by, one in self.reports.items() if by is None or trusts(by)]
        return max(count, key=lambda one: one.report.motion.at, default=None)

    def label_of(self, heard: Heard) -> str:
        """Call sign or serial number, by the same receiver."""
        return (self.names.get(heard.by, "") if heard.by is not None else "") or heard.report.name

    def threat_to(self, drone_id: DroneId, now: float) -> Threat | None:
        threat, at = self.threatens.get(drone_id, (None, 0.0))
        return threat if now - at <= THREAT_S else None


class AircraftTable:
    """What all witnesses say."""

    def __init__(self, shares: Shares | None = None) -> None:
        self._shares = shares or Shares()
        self._known: dict[str, Aircraft] = {}
        self._of: dict[Witness, OrderedDict[str, None]] = {}
        """The aircraft that each witness hears; the one heard last is last."""
        self._names: dict[DroneId, dict[str, str]] = {}
        self.left_out = 0
        """How often one was dropped because a witness named too many."""

    def __len__(self) -> int:
        return len(self._known)

    def __iter__(self) -> Iterator[Aircraft]:
        return iter(self._known.values())

    def heard_by_drone(self) -> dict[DroneId, int]:
        """How many each receiver on board hears."""
        return {by: len(heard) for by, heard in self._of.items() if by is not None}

    def take(self, report: Report, by: Witness, now: float) -> None:
        if now - report.motion.at > KEEP_S:
            return
        heard = self._of.setdefault(by, OrderedDict())
        one = self._known.setdefault(report.key, Aircraft(report.key))
        before = one.reports.get(by)
        if before is None or report.motion.at >= before.motion.at:
            one.reports[by] = report
        if by is not None and report.key in self._names.get(by, ()):
            one.names[by] = self._names[by][report.key]
        heard[report.key] = None
        heard.move_to_end(report.key)
        most = MAX_OF_FEED if by is None else self._shares.limit(ShareName.AIRCRAFT)
        while len(heard) > most:
            self.left_out += 1
            self._forget(next(iter(heard)), by)

    def name(self, identity: Identity, by: DroneId) -> None:
        names = self._names.setdefault(by, {})
        if len(names) >= self._shares.limit(ShareName.AIRCRAFT):
            names.clear()  # senders say their names again every few seconds
        names[identity.key] = identity.name
        one = self._known.get(identity.key)
        if one is not None and by in one.reports:
            one.names[by] = identity.name

    def threaten(self, threat: Threat, to: DroneId, now: float) -> None:
        one = self._known.get(threat.key)
        if one is not None and to in one.reports:
            one.threatens[to] = threat, now

    def forget_old(self, now: float) -> None:
        for one in list(self._known.values()):
            for by, report in list(one.reports.items()):
                if now - report.motion.at > KEEP_S:
                    self._forget(one.key, by)

    def _forget(self, key: str, by: Witness) -> None:
        one, heard = self._known[key], self._of[by]
        del one.reports[by], heard[key]
        one.along_since.pop(by, None)
        if by is not None:
            one.names.pop(by, None)
            one.threatens.pop(by, None)
        if not one.reports:
            del self._known[key]
        if not heard:
            del self._of[by]
            if by is not None:
                self._names.pop(by, None)
