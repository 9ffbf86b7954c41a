"""Decides which heartbeats the agent sends to the autopilot, and when. No I/O.

The agent always sends its own. It sends a ground station's only while a person is at the controls and the tower is
present, or while it holds the drone itself: the autopilot's own failsafe watches these, so one too many hides the loss
of the pilot. In a hold that loss is known, and a failsafe that acted on it would end the hold.
"""

from typing import Final

from onboard_agent.autopilot.own_frames import (
    FrameMaker,
    agent_heartbeat,
    agent_sender,
    ground_station_heartbeat,
    ground_station_sender,
)

BEAT_S: Final = 1.0

TOWER_IS_THERE_S: Final = 2.0
"""Ground-station heartbeats stop when the tower has been silent for this long."""

_SYSTEM_ID_UNTIL_HEARD: Final = 1


class Presence:
    """Call `due` at each tick."""

    def __init__(self, maker: FrameMaker, *, speaks_first: bool) -> None:
        self._maker = maker
        self._speaks_first = speaks_first
        self._next_agent = 0.0
        self._next_ground_station = 0.0
        self._ground_station_at: float | None = None

    def station_silent_s(self, now: float) -> float | None:
        """Seconds since the last heartbeat of a ground station; None: none was sent, or the next is not late."""
        silent_s = None if self._ground_station_at is None else now - self._ground_station_at
        return None if silent_s is None or silent_s < 2 * BEAT_S else silent_s

    def due(
        self,
        now: float,
        *,
        vehicle_system_id: int | None,
        ground_station_system_id: int,
        holder_present: bool,
        tower_silent_s: float,
        holds: bool,
    ) -> list[bytes]:
        """Returns heartbeats to send to the autopilot now.

        Until the autopilot is heard, its sysid is unknown and the agent sends nothing, unless the autopilot cannot find
        the agent otherwise.
        """
        frames: list[bytes] = []
        system_id = vehicle_system_id
        if system_id is None and self._speaks_first:
            system_id = _SYSTEM_ID_UNTIL_HEARD
        if system_id is not None and now >= self._next_agent:
            self._next_agent = now + BEAT_S
            frames.append(self._maker.make(agent_heartbeat(), agent_sender(system_id)))
        somebody_flies = holder_present and tower_silent_s < TOWER_IS_THERE_S
        if (somebody_flies or holds) and vehicle_system_id is not None and now >= self._next_ground_station:
            self._next_ground_station = now + BEAT_S
            self._ground_station_at = now
            sender = ground_station_sender(ground_station_system_id)
            frames.append(self._maker.make(ground_station_heartbeat(), sender))
        return frames
