"""The way up, from the autopilot to the tower: which profile is in force and why, and the thinning by it. No I/O."""

import logging
from typing import Final

from onboard_agent.telemetry.auto_profile import AutoProfile, Measured
from onboard_agent.telemetry.thinner import Thinner
from wire.control_messages import StreamSettings, StreamState
from wire.stream_profiles import StreamChoice, StreamProfile

_log = logging.getLogger(__name__)

MEASURE_EVERY_S: Final = 0.25

SETTLED_AFTER_S: Final = 5.0
"""A new link has sent too little before that: one packet lost of two is not a loss of a half."""

BY_HAND_FOR_S: Final = 3.0
"""The pilot's rates stay this long after the holder's last sticks: RC_OVERRIDE_TIME of the autopilots."""


class TelemetryStream:
    """Give frames to `admit`, send what it and `due` return. Tell it what was chosen and what the link is like."""

    def __init__(self) -> None:
        self.thinner = Thinner()
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
        """The tower tells what was chosen for this drone. Kept over a lost link."""
        self._choice = settings.profile
        self._put_in_force()

    def link_up(self, now: float) -> None:
        """A new link: it has to be measured again."""
        self._link_up_at = now
        self._auto.new_link()

    def link_down(self) -> None:
        """Nothing can be measured."""
        self._link_up_at = None

    def wants_measurement(self, now: float) -> bool:
        """Whether it is time for `measured` again."""
        return (
            self._link_up_at is not None
            and now - self._link_up_at >= SETTLED_AFTER_S
            and now - self._measured_at >= MEASURE_EVERY_S
        )

    def measured(self, measured: Measured, now: float) -> None:
        """The link as it is now. Judged even while the profile is set by hand, so that `auto` begins where it is."""
        self._measured_at = now
        self._auto.measured(measured, now)
        self._put_in_force()

    def sticks_passed(self, now: float) -> None:
        """The holder flies by hand."""
        self._sticks_at = now

    def admit(self, frames: list[bytes]) -> list[bytes]:
        """Those of the autopilot's frames that go to the tower at once."""
        return self.thinner.admit(frames)

    def due(self, now: float) -> list[bytes]:
        """Frames that have waited for their beat, at each tick."""
        self.thinner.by_hand = now - self._sticks_at < BY_HAND_FOR_S
        return self.thinner.due(now)

    def resend(self) -> None:
        """A new tower link knows nothing."""
        self._sent = None

    def changed(self) -> StreamState | None:
        """The report for the tower, if it differs from the last one."""
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
