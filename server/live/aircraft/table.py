"""The aircraft that somebody hears: bounded, with ages, and by whom. Pure; takes `now`."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from server.live.aircraft.decode import Identity, Report, Threat
from wire.ids import DroneId

MAX_AIRCRAFT: Final = 500
KEEP_S: Final = 60.0
"""An aircraft that nobody has heard for this long is forgotten."""
THREAT_S: Final = 5.0


@dataclass
class Aircraft:
    """`heard_by`: which drones, and when last."""

    report: Report
    heard_by: dict[DroneId, float] = field(default_factory=dict)
    fed_at: float = float("-inf")
    """When the network feed had it last."""
    threat: Threat | None = None
    threat_at: float = float("-inf")
    name: str = ""
    is_own: bool = False
    """One of the tower's own drones, by its Remote ID or its transponder."""
    along_since: float | None = None
    """Since when it is where one of them is."""

    @property
    def key(self) -> str:
        return self.report.key

    @property
    def label(self) -> str:
        return self.name or self.report.name


class AircraftTable:
    """The newest position of an aircraft counts, whoever reports it."""

    def __init__(self) -> None:
        self._known: dict[str, Aircraft] = {}
        self._names: dict[str, str] = {}
        self.left_out = 0
        """How often one was dropped because there were too many."""

    def __len__(self) -> int:
        return len(self._known)

    def __iter__(self) -> Iterator[Aircraft]:
        return iter(self._known.values())

    def get(self, key: str) -> Aircraft | None:
        return self._known.get(key)

    def take(self, report: Report, by: DroneId | None, now: float) -> None:
        """`by`: the drone whose receiver heard it; None: the network feed."""
        if now - report.motion.at > KEEP_S:
            return
        one = self._known.get(report.key)
        if one is None:
            if len(self._known) >= MAX_AIRCRAFT:
                self.left_out += 1
                oldest = min(self._known.values(), key=lambda known: known.report.motion.at)
                if oldest.report.motion.at >= report.motion.at:
                    return
                del self._known[oldest.key]
            one = self._known[report.key] = Aircraft(report, name=self._names.get(report.key, ""))
        elif report.motion.at >= one.report.motion.at:
            one.report = report
        if by is None:
            one.fed_at = now
        else:
            one.heard_by[by] = now

    def name(self, identity: Identity) -> None:
        if len(self._names) >= MAX_AIRCRAFT:
            self._names.clear()  # senders say their names again every few seconds
        self._names[identity.key] = identity.name
        one = self._known.get(identity.key)
        if one is not None:
            one.name = identity.name

    def threaten(self, threat: Threat, now: float) -> None:
        one = self._known.get(threat.key)
        if one is not None:
            one.threat, one.threat_at = threat, now

    def forget_old(self, now: float) -> None:
        for key, one in list(self._known.items()):
            if now - one.report.motion.at > KEEP_S:
                del self._known[key]
                continue
            one.heard_by = {drone_id: at for drone_id, at in one.heard_by.items() if now - at <= KEEP_S}
            if one.threat is not None and now - one.threat_at > THREAT_S:
                one.threat = None
