"""Drones in the air at other towers, as those tell twice a second. No I/O; takes `now`.

The home of a drone alone says where it is. Each message of a tower names all that it has in the air: what it does not
name any more has landed. A tower that falls silent says nothing: its positions grow old, and are dropped.
"""

from collections.abc import Callable, Iterable, Iterator
from typing import Final, NamedTuple

import msgspec

from server.airspace.core.separation.motion import Motion
from wire.ids import DroneId, UserId

KEEP_S: Final = 15.0
"""Longer than an alert about a silent drone lasts (STALE_S and UNHEARD_S of the watch)."""
MAX_TOLD: Final = 10_000
"""Drones in one message: some 400 kB."""


class DroneInAir(msgspec.Struct, frozen=True, array_like=True):
    """One drone in the air at the sender. Degrees times 10^7, millimetres above the sea, cm/s, milliseconds.

    `credible`: whether others may be alarmed about it (`credible.py`). `without_view`: the user who may not watch it
    though it is theirs.
    """

    drone_id: int
    lat_e7: int
    lon_e7: int
    alt_amsl_mm: int
    north_cm_s: int
    east_cm_s: int
    up_cm_s: int
    age_ms: int
    credible: bool | None
    without_view: int | None


class Elsewhere(NamedTuple):
    """What is known of one drone at another tower."""

    tower: str
    motion: Motion
    credible: bool | None
    without_view: UserId | None


class DronesElsewhere:
    """One for the hub. Empty without a bus."""

    def __init__(self) -> None:
        self._known: dict[DroneId, Elsewhere] = {}

    def __len__(self) -> int:
        return len(self._known)

    def get(self, drone_id: DroneId) -> Elsewhere | None:
        """None: it is on the ground there, or nobody has told of it for KEEP_S."""
        return self._known.get(drone_id)

    def motions(self) -> Iterator[tuple[DroneId, Motion]]:
        return ((drone_id, one.motion) for drone_id, one in self._known.items())

    def learn(
        self,
        tower: str,
        told: Iterable[DroneInAir],
        now: float,
        *,
        late_s: float,
        home_of: Callable[[DroneId], str | None],
    ) -> None:
        """Everything that this tower has in the air. `late_s`: how long the message was under way beyond the usual."""
        named = set()
        for one in told:
            drone_id = DroneId(one.drone_id)
            if home_of(drone_id) != tower:
                continue  # it has moved on, and its new home tells
            named.add(drone_id)
            barred = None if one.without_view is None else UserId(one.without_view)
            at = now - one.age_ms / 1000 - late_s
            self._known[drone_id] = Elsewhere(tower, _motion_of(one, at), one.credible, barred)
        for drone_id in [one for one, known in self._known.items() if known.tower == tower and one not in named]:
            del self._known[drone_id]

    def forget_old(self, now: float) -> None:
        """Drops positions that nobody has renewed. Call it once a second."""
        for drone_id in [one for one, known in self._known.items() if now - known.motion.at > KEEP_S]:
            del self._known[drone_id]


def in_air(
    drone_id: DroneId, motion: Motion, now: float, *, credible: bool | None, without_view: UserId | None
) -> DroneInAir:
    """For the other towers."""
    return DroneInAir(
        drone_id,
        round(motion.lat_deg * 1e7),
        round(motion.lon_deg * 1e7),
        round(motion.alt_amsl_m * 1000),
        round(motion.north_m_s * 100),
        round(motion.east_m_s * 100),
        round(motion.up_m_s * 100),
        max(0, round((now - motion.at) * 1000)),
        credible,
        without_view,
    )


def _motion_of(one: DroneInAir, at: float) -> Motion:
    return Motion(
        one.lat_e7 / 1e7,
        one.lon_e7 / 1e7,
        one.alt_amsl_mm / 1000,
        one.north_cm_s / 100,
        one.east_cm_s / 100,
        one.up_cm_s / 100,
        at,
    )
