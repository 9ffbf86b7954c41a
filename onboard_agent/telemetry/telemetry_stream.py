"""Telemetry from the autopilot to the tower: the profile in force, the reason for it, and thinning by it. No I/O."""

import logging
from collections.abc import Mapping
from typing import Final

from onboard_agent.telemetry.auto_profile import AutoProfile, Measured
from onboard_agent.telemetry.spacing import Spacing
from onboard_agent.telemetry.thinner import Thinner
from wire.control_messages import StreamSettings, StreamState
from wire.stream_profiles import StreamChoice, StreamProfile

_log = logging.getLogger(__name__)

MEASURE_EVERY_S: Final = 0.25

SETTLED_AFTER_S: Final = 5.0
"""Before this a new link has sent too little to measure: one packet lost out of two is not a loss of one half."""

BY_HAND_FOR_S: Final = 3.0
"""The pilot's rates stay this long after the holder's last sticks: RC_OVERRIDE_TIME of the autopilots."""


class TelemetryStream:
    """Pass frames to `admit`, and send what it and `due` return. Report the setting and link measurements to it."""

    def __init__(self, usual_hz: Mapping[int, float] | None = None) -> None:
        """`usual_hz`: messages that come faster than the tower wants them, and how often they go there."""
        self.thinner = Thinner()
        self._spacing = Spacing(usual_hz or {})
        self._choice = StreamChoice.AUTO
        self._auto = AutoProfile()
        self._link_up_at: float | None = None
        self._measured_at = float("-inf")
        self._sticks_at = float("-inf")
        self._sent: StreamState | None = None

    @property
    def profile(self) -> StreamProfile:
        """The profile in force."""
        return self.thinner.profile

    def chosen(self, settings: StreamSettings) -> None:
        """The tower reports the setting for this drone. It is kept while the link is lost."""
        self._choice = settings.profile
        self._put_in_force()

    def link_up(self, now: float) -> None:
        """A new link is up and must be measured again."""
        self._link_up_at = now
        self._auto.new_link()

    def link_down(self) -> None:
        """The link is down: no measurements until the next one."""
        self._link_up_at = None

    def wants_measurement(self, now: float) -> bool:
        """Whether the next `measured` is due."""
        return (
            self._link_up_at is not None
            and now - self._link_up_at >= SETTLED_AFTER_S
            and now - self._measured_at >= MEASURE_EVERY_S
        )

    def measured(self, measured: Measured, now: float) -> None:
        """Takes a measurement of the link, even while the profile is set by hand, so that `auto` starts up to date."""
        self._measured_at = now
        self._auto.measured(measured, now)
        self._put_in_force()

    def sticks_passed(self, now: float) -> None:
        """The holder flies by hand."""
        self._sticks_at = now

    def admit(self, frames: list[bytes], now: float) -> list[bytes]:
        """Returns the autopilot's frames that go to the tower at once."""
        return self.thinner.admit(self._spacing.admit(frames, now))

    def due(self, now: float) -> list[bytes]:
        """Returns frames that waited for their interval. Call it at each tick."""
        self.thinner.by_hand = now - self._sticks_at < BY_HAND_FOR_S
        return self.thinner.due(now)

    def resend(self) -> None:
        """Reports the state again on a new tower link."""
        self._sent = None

    def changed(self) -> StreamState | None:
        """Returns the state for the tower if it changed since the last report, else None."""
        state = self._state()
        if state == self._sent:
            return None
        self._sent = state
        return state

    def _state(self) -> StreamState:
        by_hand = self._choice is not StreamChoice.AUTO
        why = "set by an admin" if by_hand else self._auto.why
        return StreamState(profile=self.profile, chosen=self._choice, why=why)

    def _put_in_force(self) -> None:
        chosen = self._choice
        profile = self._auto.profile if chosen is StreamChoice.AUTO else StreamProfile(chosen.value)
        before = self.thinner.profile
        if profile is not before:
            self.thinner.profile = profile
            _log.info("stream profile: %s, was %s: %s", profile, before, self._state().why)
