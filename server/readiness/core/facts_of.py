"""Reads the facts of the preflight checklist from the live state. No I/O."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, Protocol

from server.readiness.core.checks import PreflightFacts
from wire.autopilots import registry
from wire.autopilots.profile import AutopilotProfile
from wire.frames import payload
from wire.plans import PlanKind

if TYPE_CHECKING:
    from server.control.core.loss_words import Sentence
    from server.live.live_drone import LiveDrone

_TYPE, _AUTOPILOT, _HEARTBEAT_BYTES = 4, 5, 9
"""Offsets in a HEARTBEAT, and its length."""
UNKNOWN_KIND: Final = ""
REMOTE_ID_WITHIN_S: Final = 10.0
"""A transmitter reports once a second."""


class LossResult(Protocol):
    """What the check before flight found."""

    @property
    def complete(self) -> bool: ...

    @property
    def sentences(self) -> Sequence[Sentence]: ...

    @property
    def acknowledged(self) -> bool: ...


def profile_of(drone: LiveDrone) -> AutopilotProfile | None:
    """The profile of its autopilot, also of a drone that is silent now; None before the first heartbeat."""
    last = drone.last_heard.view
    if drone.heartbeat is not None:
        heart = payload(drone.heartbeat).ljust(_HEARTBEAT_BYTES, b"\0")
        return registry.nearest(heart[_AUTOPILOT], heart[_TYPE])
    if last is not None and last.autopilot is not None and last.vehicle_type is not None:
        return registry.nearest(last.autopilot, last.vehicle_type)
    return None


def kind_of(drone: LiveDrone) -> str:
    """The kind by which own lines are kept: the key of its profile; empty: not known."""
    profile = profile_of(drone)
    return UNKNOWN_KIND if profile is None else profile.key


def preflight_facts(drone: LiveDrone, loss: LossResult, now: float) -> PreflightFacts:
    """What the tower knows of the drone now."""
    telemetry = drone.telemetry
    telemetry.decode(now)
    is_heard = drone.online and drone.autopilot_heard
    quality = None if drone.link is None else drone.link.quality(now)
    mission, _ = drone.onboard.plan(PlanKind.MISSION)
    fence, _ = drone.onboard.plan(PlanKind.FENCE)
    severities = [one.severity for one in loss.sentences]
    return PreflightFacts(
        online=drone.online,
        heard=is_heard,
        hears_agent=drone.hears_agent if is_heard else None,
        rtt_ms=None if quality is None else quality.rtt_ms,
        loss=None if quality is None else quality.loss,
        arming_ok=telemetry.arming_ok if is_heard else None,
        arming_words=_reasons(drone, now) if is_heard else (),
        remote_id=_remote_id(drone, now) if is_heard else None,
        battery_percent=telemetry.battery_percent,
        battery_charge=telemetry.battery_charge,
        gps_fix=telemetry.gps_fix,
        satellites=telemetry.satellites,
        gps_number=telemetry.gps_number,
        has_home=drone.has_reported_home,
        return_height_m=_return_height_m(drone),
        loss_complete=loss.complete,
        loss_dangers=severities.count("danger"),
        loss_warnings=severities.count("warning"),
        loss_acknowledged=loss.acknowledged,
        plan_known=mission.state == "known",
        plan_items=mission.count,
        plan_fits=mission.fit_to_fly,
        fence_known=fence.state == "known",
        fence_items=fence.count,
    )


def _reasons(drone: LiveDrone, now: float) -> tuple[str, ...]:
    """Events that bar other flight modes, or nothing, are no reasons."""
    telemetry = drone.telemetry
    if telemetry.checks is None or drone.heartbeat is None:
        return telemetry.arming_texts.now(now)
    if telemetry.arming_ok is not False:
        return ()
    custom_mode = int.from_bytes(payload(drone.heartbeat)[:4], "little")
    return telemetry.checks.reasons(custom_mode) or telemetry.arming_texts.now(now)


def _remote_id(drone: LiveDrone, now: float) -> str | None:
    """Why its transmitter is not ready; empty: it is; None: none has reported lately."""
    told = drone.telemetry.remote_id
    return None if told is None or now - told.at > REMOTE_ID_WITHIN_S else told.problem


def _return_height_m(drone: LiveDrone) -> float | None:
    profile, table = profile_of(drone), drone.onboard.parameters.table()
    if profile is None or table is None:
        return None
    values = {one.name: one.value for one in table}
    return next(
        (values[name] * metres for name, metres in profile.family.return_heights.items() if name in values), None
    )
