"""PX4's stick positions: from the receiver on board, or from a ground station's MANUAL_CONTROL.

Rules, each with a test:
- Any sender may send sticks; no sysid is configured.
- COM_RC_IN_MODE: 0 receiver only, 1 MAVLink only, 2 the one in use until it falls silent, 3 the first since boot, 4
  none.
- RC_CHANNELS_OVERRIDE counts as a receiver; on channels 1 to 8, 0 is an ordinary value: full deflection.
- A source that is silent for COM_RC_LOSS_T is lost. Its last values stay, but no mode may fly by them.
- Sticks move while a filter of 0.1 s over the change of an axis is above COM_RC_STICK_OV (its sources; measured: a jump
  counts as motion for 0.4 to 0.5 s). The first values of a source are no motion.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto

from simulator.flight_constants import TICK_S
from simulator.geodesy import clamp
from simulator.parameters import Parameters
from simulator.receiver import CHANNELS, RECEIVER_CHANNELS, Receiver

IGNORE = 65535
MOTION_FILTER_S = 0.1


class Source(Enum):
    RECEIVER = auto()
    MAVLINK = auto()


@dataclass(slots=True)
class Axes:
    """-1..1 each; pitch positive forward, throttle 0 is the middle."""

    roll: float = 0.0
    pitch: float = 0.0
    throttle: float = -1.0
    yaw: float = 0.0


class Px4Sticks:
    def __init__(self, parameters: Parameters, receiver: Receiver) -> None:
        self._parameters = parameters
        self.receiver = receiver
        self.radio_pwm = receiver.at_rest
        self.pwm = list(self.radio_pwm)
        self.ever_heard = False
        self._axes: dict[Source, Axes] = {}
        self._heard_s: dict[Source, float] = {}
        self._used: Source | None = None
        self._used_heard_s = 0.0
        self._first: Source | None = None
        self._now_s = 0.0
        self._before: tuple[float, ...] | None = None
        self._change_per_s = [0.0] * 4

    def accepts(self, sender_sysid: int) -> bool:
        del sender_sysid
        return True

    @property
    def overridden(self) -> bool:
        return self._used is Source.MAVLINK

    @property
    def channel_count(self) -> int:
        """The channels of the active receiver; RC_CHANNELS_OVERRIDE counts as one."""
        if not self._is_fresh(Source.RECEIVER):
            return 0
        return RECEIVER_CHANNELS if self.receiver.is_fitted else CHANNELS

    def clear_overrides(self) -> None:
        """PX4 has no overrides to clear."""

    def override(self, channels: list[int], now_s: float) -> None:
        for index, value in enumerate(channels[:CHANNELS]):
            if value != IGNORE and not (index >= 8 and value == 0):
                self.pwm[index] = value
        self._receive(Source.RECEIVER, self._axes_of(self.pwm), now_s)

    def manual_control(self, *, x: int, y: int, z: int, r: int, now_s: float) -> None:
        """An axis out of its range counts as absent and reads as centred."""
        throttle = z / 500.0 - 1.0 if 0 <= z <= 1000 else 0.0
        axes = (value / 1000.0 if abs(value) <= 1000 else 0.0 for value in (y, x, r))
        roll, pitch, yaw = axes
        self._receive(Source.MAVLINK, Axes(roll, pitch, throttle, yaw), now_s)

    def _receive(self, source: Source, axes: Axes, now_s: float) -> None:
        self._axes[source], self._heard_s[source] = axes, now_s

    def update(self, now_s: float, *, transmitter_lost: bool) -> None:
        self._now_s = now_s
        if self.receiver.is_fitted and not transmitter_lost:
            self.pwm[:] = self.radio_pwm
            self._receive(Source.RECEIVER, self._axes_of(self.radio_pwm), now_s)
        fresh = [source for source in Source if self._is_fresh(source)]
        if self._first is None and fresh:
            self._first = fresh[0]
        self._used = self._choose(fresh)
        if self._used is not None:
            self.ever_heard = True
            self._used_heard_s = self._heard_s[self._used]
        self._filter_motion()

    def _filter_motion(self) -> None:
        if self._used is None:
            self._before, self._change_per_s = None, [0.0] * 4
            return
        flown = self._axes[self._used]
        now = (flown.roll, flown.pitch, flown.throttle, flown.yaw)
        share = TICK_S / (MOTION_FILTER_S + TICK_S)
        for at, (value, before) in enumerate(zip(now, self._before or now, strict=True)):
            self._change_per_s[at] += share * ((value - before) / TICK_S - self._change_per_s[at])
        self._before = now

    @property
    def moving(self) -> bool:
        """Whether a pilot seems to take over."""
        threshold = self._parameters["COM_RC_STICK_OV"] / 100.0
        return any(abs(change) > threshold for change in self._change_per_s)

    def _choose(self, fresh: list[Source]) -> Source | None:
        mode = self._parameters.whole("COM_RC_IN_MODE")
        if mode == 2:
            if self._used in fresh:
                return self._used
            return fresh[0] if fresh else None
        wanted = {0: Source.RECEIVER, 1: Source.MAVLINK, 3: self._first}.get(mode)
        return wanted if wanted in fresh else None

    def _is_fresh(self, source: Source) -> bool:
        heard_s = self._heard_s.get(source)
        return heard_s is not None and self._now_s - heard_s < self._parameters["COM_RC_LOSS_T"]

    @property
    def lost(self) -> bool:
        return self._used is None

    def silent_for_s(self, now_s: float) -> float:
        """Returns 0 while the source in use is fresh; other sources are ignored."""
        return 0.0 if self._used is not None else max(now_s - self._used_heard_s, TICK_S)

    def _axes_of(self, pwm: list[int]) -> Axes:
        def axis(name: str) -> float:
            channel = self._parameters.whole(f"RC_MAP_{name}")
            low, middle, high = (self._parameters[f"RC{channel}_{end}"] for end in ("MIN", "TRIM", "MAX"))
            value = pwm[channel - 1]
            span = high - middle if value > middle else middle - low
            return clamp((value - middle) / span, -1.0, 1.0)

        return Axes(axis("ROLL"), -axis("PITCH"), axis("THROTTLE"), axis("YAW"))

    # The pilot's input, as the flight modes read it.

    @property
    def _flown(self) -> Axes:
        return self._axes[self._used] if self._used is not None else Axes(throttle=0.0)

    @property
    def roll(self) -> float:
        return self._flown.roll

    @property
    def pitch(self) -> float:
        """-1 forward (nose down) .. 1 back."""
        return -self._flown.pitch

    @property
    def yaw(self) -> float:
        return self._flown.yaw

    @property
    def throttle(self) -> float:
        """0..1000."""
        return (self._flown.throttle + 1.0) * 500.0

    @property
    def throttle_mid(self) -> float:
        return 500.0

    @property
    def climb_mps(self) -> float:
        throttle, zone = self._flown.throttle, self._parameters["MPC_HOLD_DZ"]
        if throttle > zone:
            return self._parameters["MPC_Z_VEL_MAX_UP"] * (throttle - zone) / (1.0 - zone)
        if throttle < -zone:
            return self._parameters["MPC_Z_VEL_MAX_DN"] * (throttle + zone) / (1.0 - zone)
        return 0.0

    @property
    def mode_switch(self) -> int | None:
        """RC_MAP_FLTMODE is 0: no switch is mapped."""
        return None
