"""Requests data from the autopilot and keeps the answers: rates, parameters, radio. No I/O.

Combines `Rates`, `Parameters`, `Radio` and `LossReport`; makes no flight decisions.
"""

from typing import Any, Final

from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.autopilot.parameters import Parameters
from onboard_agent.autopilot.radio import Radio
from onboard_agent.autopilot.rates import Rates
from onboard_agent.failsafe.after_sticks import after_sticks
from onboard_agent.failsafe.loss_report import LossReport
from wire.autopilots import registry
from wire.control_messages import LossParameters
from wire.dialect import mavlink
from wire.ids import SystemId
from wire.open_holds import AfterSticks, LostAction
from wire.stream_profiles import StreamProfile

READ: Final = frozenset(
    {
        mavlink.MAVLINK_MSG_ID_PARAM_VALUE,
        mavlink.MAVLINK_MSG_ID_SYS_STATUS,
        mavlink.MAVLINK_MSG_ID_RC_CHANNELS,
    }
)
"""Messages of the autopilot to pass to `answer`."""


class Inquiry:
    """Call `ask_all` when the autopilot appears or has rebooted, and `due` at each tick; feed it the READ messages."""

    def __init__(self, maker: FrameMaker, *, narrow_line: bool, research_hz: float = 0.0) -> None:
        self._rates = Rates(maker, narrow_line=narrow_line, research_hz=research_hz)
        self._parameters = Parameters(maker)
        self._radio = Radio()
        self._report = LossReport()
        self._channels_alone = False
        """Only RC_CHANNELS tells of a receiver."""

    def assume_ground_station(self, system_id: int) -> None:
        """Uses the value that the previous process has read, until it is read again."""
        self._parameters.assume_ground_station(system_id)

    @property
    def ground_station_system_id(self) -> int:
        """The sysid whose sticks the autopilot obeys."""
        return self._parameters.ground_station_system_id

    @property
    def channel_middles_us(self) -> tuple[int, int, int, int]:
        """Pulse widths of roll, pitch, throttle and yaw with the sticks in the middle."""
        return self._parameters.channel_middles_us

    @property
    def overrides_last_s(self) -> float:
        """How long the autopilot obeys the last sticks that it received."""
        return self._parameters.overrides_last_s

    @property
    def has_radio(self) -> bool | None:
        """Whether a receiver is on board; None while unknown."""
        return self._radio.has_radio

    def after_sticks(
        self, autopilot_kind: int, custom_mode: int, now: float, *, trusts_receiver: bool = False
    ) -> AfterSticks:
        """What the autopilot does in this mode when sticks stop.

        `trusts_receiver`: supposes that a receiver which received a transmitter before the sticks still does.
        """
        may_hide = self.sticks_hide_receiver(autopilot_kind) and not trusts_receiver
        return after_sticks(
            autopilot_kind,
            custom_mode,
            values=self._parameters.values,
            has_radio=self._radio.has_radio,
            hidden=may_hide and self._radio.hidden(now, overrides_last_s=self.overrides_last_s),
        )

    def station_lost(
        self, autopilot_kind: int, custom_mode: int, *, mission_is_over: bool
    ) -> tuple[LostAction, float] | None:
        """What the autopilot does by itself without a ground station's heartbeats, and how many seconds after the last
        one. None: nothing, or not known."""
        family = registry.FAMILIES.get(autopilot_kind)
        values = self._parameters.values
        return None if family is None else family.station_lost(values, custom_mode, mission_is_over)

    def sticks_hide_receiver(self, autopilot_kind: int) -> bool:
        """Whether sticks in force hide what the receiver receives."""
        family = registry.FAMILIES.get(autopilot_kind)
        return family is not None and family.sticks_hide_receiver

    def ignores_sticks(self, autopilot_kind: int) -> bool:
        """Whether it is known that sticks from the agent move nothing."""
        family = registry.FAMILIES.get(autopilot_kind)
        return family is not None and family.ignores_sticks(self._parameters.values, self._radio.has_radio)

    def sticks_settle_s(self, autopilot_kind: int) -> float:
        """How long sticks must not move before a mode without sticks is requested."""
        family = registry.FAMILIES.get(autopilot_kind)
        return 0.0 if family is None else family.sticks_settle_s(self._parameters.values)

    def switched(self, now: float) -> bool:
        """Whether a switch of the transmitter has just moved."""
        return self._radio.switched(now)

    def arms_with_sticks_at_rest(self, autopilot_kind: int) -> bool:
        """Whether the autopilot needs the throttle at the bottom to arm, and has no receiver that provides it."""
        family = registry.FAMILIES.get(autopilot_kind)
        return family is not None and family.arms_with_throttle_down and self._radio.has_radio is False

    def ask_all(self, autopilot_kind: int, now: float) -> None:
        """Requests everything from the beginning."""
        self._rates.ask_all(now)
        self._parameters.ask_all(autopilot_kind)
        family = registry.FAMILIES.get(autopilot_kind)
        self._channels_alone = family is not None and family.silent_without_receiver
        self._radio.asked(now)

    def follow(self, profile: StreamProfile) -> None:
        """Sets the stream profile: on a narrow line the agent requests no more than goes to the tower."""
        self._rates.follow(profile)

    def heard(self, message_id: int, now: float) -> None:
        """Any message of the autopilot arrived."""
        self._rates.heard(message_id, now)

    def answer(self, message_id: int, message: Any, frame: bytes, now: float) -> None:
        """Handles a message of READ from the autopilot."""
        lapse_s = self._parameters.overrides_last_s
        if message_id == mavlink.MAVLINK_MSG_ID_PARAM_VALUE:
            self._parameters.value(frame)
        elif message_id == mavlink.MAVLINK_MSG_ID_SYS_STATUS and not self._channels_alone:
            self._radio.sys_status(message, now, overrides_last_s=lapse_s)
        elif message_id == mavlink.MAVLINK_MSG_ID_RC_CHANNELS:
            self._radio.rc_channels(message, now, overrides_last_s=lapse_s)

    def acknowledged(self, ack: Any, now: float) -> None:
        """Handles a COMMAND_ACK that is addressed to the agent."""
        self._rates.acknowledged(ack, now)

    def sticks_sent(self, now: float) -> None:
        """Sticks from the holder or the agent went to the autopilot, which may report them as the radio's."""
        self._radio.sticks_sent(now)

    def due(self, now: float, *, vehicle_system_id: SystemId) -> list[bytes]:
        """Requests to send now."""
        if self._channels_alone:
            self._radio.check(now)
        requests = (
            self._rates.due(now, vehicle_system_id=vehicle_system_id),
            self._parameters.due(now, vehicle_system_id=vehicle_system_id),
        )
        return [request for request in requests if request is not None]

    def loss_report(self, autopilot_kind: int) -> LossParameters | None:
        """Returns the parameters that decide on a loss if they changed since the last report, else None."""
        return self._report.changed(self._parameters, autopilot_kind=autopilot_kind, has_radio=self._radio.has_radio)

    def resend(self) -> None:
        """Reports everything again on a new tower link."""
        self._report.resend()
