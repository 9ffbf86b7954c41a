"""State of the autopilot: present, armed, in the air, and its flight mode. No I/O.

Only the autopilot component counts (compid 1): gimbals, cameras and companions on the same line send heartbeats too.
"""

from enum import StrEnum
from typing import Any, Final

from onboard_agent.autopilot.own_failsafe import OwnFailsafe
from wire.autopilots import registry
from wire.autopilots.vehicle_types import NEVER_FLY
from wire.control_messages import AutopilotState
from wire.dialect import mavlink
from wire.ids import SystemId
from wire.own_system import SILENT_S
from wire.signing_key import Signing

HEARD_WITHIN_S: Final = 3.0
"""After this silence the autopilot counts as lost: three heartbeats."""

FORGOTTEN_AFTER_S: Final = SILENT_S
"""Silence after which it counts as rebooted."""

CLOCK_STEP_BACK_MS: Final = 2_000
"""A boot clock that goes back this far has restarted; a smaller step is packets out of order."""

AIRBORNE_ABOVE_M: Final = 1.0

DESCRIBES: Final = frozenset(
    {
        mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE,
        mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION,
        mavlink.MAVLINK_MSG_ID_MISSION_CURRENT,
    }
)
"""Messages for `described`."""

_STATE_IS_FRESH_S: Final = 3.0
_ARMED: Final = 0x80
_ON_GROUND: Final = 1


class AutopilotEvent(StrEnum):
    """A change caused by a message or by elapsed time."""

    HEARD = "heard"
    LOST = "lost"
    REBOOTED = "rebooted"


class AutopilotView:
    """Feed it decoded messages of the autopilot and the time; read its attributes."""

    def __init__(self) -> None:
        self.system_id: SystemId | None = None
        self.kind = 0
        """MAV_AUTOPILOT of the last heartbeat."""
        self.vehicle_type = 0
        self.firmware = 0
        """flight_sw_version of its AUTOPILOT_VERSION; 0: not known."""
        self.armed = False
        self.custom_mode = 0
        self.heard = False
        self.outside_fence = False
        """The autopilot reports that it is outside its fence."""
        self.mission_is_over = False
        """It reports that its mission is complete. ArduCopter then hovers, still in AUTO."""
        self._heard_at = 0.0
        self._boot_ms = 0
        self._landed_state = 0
        self._landed_state_at: float | None = None
        self._on_ground_since: float | None = None
        self._alt_rel_m = 0.0
        self.failsafe = OwnFailsafe()
        self.other_systems: tuple[int, ...] = ()
        self.stick_gestures = 0
        self.system_is_fixed = False
        """The agent serves this system id and will follow no change of it."""
        """System ids of other autopilots on the line."""
        self.hears_agent: bool | None = None
        """None: not known."""
        self.line_signing = Signing.OFF
        """Of the agent's own key on the line."""
        self.sends_signed = False
        """Its last heartbeat came with a signature that the agent has no key for."""
        self._sent: AutopilotState | None = None

    @property
    def may_be_held(self) -> bool:
        """Whether it is known what sticks and modes do to it. The agent sends none to any other vehicle by itself."""
        profile = registry.of(self.kind, self.vehicle_type)
        return profile is not None and not profile.is_watched_only

    @property
    def watched_only(self) -> bool:
        """Whether it was heard, and may not be held."""
        return self.system_id is not None and not self.may_be_held

    @property
    def signing(self) -> Signing:
        """Whether the line is signed, and which side has no key that fits."""
        return Signing.NO_KEY if self.sends_signed and self.line_signing is Signing.OFF else self.line_signing

    def assume(self, kind: int, vehicle_type: int) -> None:
        """Uses the vehicle that the previous process has heard, until it is heard again."""
        self.kind, self.vehicle_type = kind, vehicle_type

    def is_autopilot(self, system_id: int, component_id: int) -> bool:
        """Whether this sender is the autopilot that was found."""
        return component_id == mavlink.MAV_COMP_ID_AUTOPILOT1 and system_id == self.system_id

    def anything_heard(self, now: float) -> None:
        """Any frame of the autopilot arrived."""
        if self.heard:
            self._heard_at = now

    def heartbeat(self, message: Any, system_id: int, component_id: int, now: float) -> AutopilotEvent | None:
        """Handles a HEARTBEAT of the drone's own system (wire.own_system). Only its autopilot's count."""
        if (
            component_id != mavlink.MAV_COMP_ID_AUTOPILOT1
            or message.autopilot == mavlink.MAV_AUTOPILOT_INVALID
            or message.type == mavlink.MAV_TYPE_GCS
        ):
            return None
        silent_s = now - self._heard_at
        long_gone = self.system_id is not None and silent_s >= FORGOTTEN_AFTER_S
        if long_gone or system_id != self.system_id:
            self._boot_ms = self.firmware = 0
            self.mission_is_over = False
            self._landed_state_at = self._on_ground_since = None
        was_heard = self.heard
        self.system_id = SystemId(system_id)
        self.kind = message.autopilot
        self.vehicle_type = message.type
        self.armed = bool(message.base_mode & _ARMED)
        self.custom_mode = message.custom_mode
        self.failsafe.heartbeat(message, now)
        self.heard = True
        self._heard_at = now
        if long_gone:
            return AutopilotEvent.REBOOTED
        return None if was_heard else AutopilotEvent.HEARD

    def described(self, message_id: int, message: Any, now: float) -> None:
        """Handles one of DESCRIBES of the autopilot."""
        if message_id == mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION:
            self.autopilot_version(message)
        elif message_id == mavlink.MAVLINK_MSG_ID_MISSION_CURRENT:
            self.mission_is_over = message.mission_state == mavlink.MISSION_STATE_COMPLETE
        else:
            self.extended_sys_state(message, now)

    def extended_sys_state(self, message: Any, now: float) -> None:
        """Handles EXTENDED_SYS_STATE of the autopilot."""
        self._landed_state = message.landed_state
        self._landed_state_at = now
        if self._landed_state != _ON_GROUND:
            self._on_ground_since = None
        elif self._on_ground_since is None:
            self._on_ground_since = now

    def autopilot_version(self, message: Any) -> None:
        """Handles AUTOPILOT_VERSION of the autopilot."""
        self.firmware = message.flight_sw_version

    def sys_status(self, message: Any) -> None:
        """Handles SYS_STATUS of the autopilot."""
        enabled = message.onboard_control_sensors_enabled & mavlink.MAV_SYS_STATUS_GEOFENCE
        healthy = message.onboard_control_sensors_health & mavlink.MAV_SYS_STATUS_GEOFENCE
        self.outside_fence = bool(enabled and not healthy)

    def global_position(self, message: Any) -> AutopilotEvent | None:
        """Handles GLOBAL_POSITION_INT of the autopilot: its height and its clock."""
        self._alt_rel_m = message.relative_alt / 1000.0
        went_back = message.time_boot_ms + CLOCK_STEP_BACK_MS < self._boot_ms
        if went_back or message.time_boot_ms > self._boot_ms:
            self._boot_ms = message.time_boot_ms
        return AutopilotEvent.REBOOTED if went_back else None

    def tick(self, now: float) -> AutopilotEvent | None:
        """Advances time."""
        if self.heard and now - self._heard_at >= HEARD_WITHIN_S:
            self.heard = False
            return AutopilotEvent.LOST
        return None

    def airborne(self, now: float) -> bool:
        """Whether it is armed and off the ground, as reported, or by its height if it does not report that."""
        if not self.armed or self.vehicle_type in NEVER_FLY:
            return False
        if self._reports_landed_state(now):
            return self._landed_state != _ON_GROUND
        return self._alt_rel_m > AIRBORNE_ABOVE_M

    def on_ground_s(self, now: float) -> float:
        """For how long it has reported that it stands on the ground; 0 if it does not report that."""
        if self._on_ground_since is None or not self._reports_landed_state(now):
            return 0.0
        return now - self._on_ground_since

    def _reports_landed_state(self, now: float) -> bool:
        return (
            self._landed_state_at is not None
            and now - self._landed_state_at < _STATE_IS_FRESH_S
            and self._landed_state != mavlink.MAV_LANDED_STATE_UNDEFINED
        )

    def changed(self, now: float) -> AutopilotState | None:
        """Returns the state for the tower if it changed since the last report, else None."""
        state = AutopilotState(
            heard=self.heard,
            armed=self.heard and self.armed,
            airborne=self.heard and self.airborne(now),
            firmware=self.firmware,
            watched_only=self.watched_only,
            system_id=self.system_id or 0,
            other_systems=self.other_systems,
            hears_agent=self.hears_agent if self.heard else None,
            signing=self.signing,
            stick_gestures=self.stick_gestures,
        )
        if state == self._sent:
            return None
        self._sent = state
        return state

    def resend(self) -> None:
        """Reports the state again on a new tower link."""
        self._sent = None
