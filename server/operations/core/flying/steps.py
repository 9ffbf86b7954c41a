"""Turns a request into a pilot's command and its order for the vehicle. Pure.

The profile of each autopilot has its form (`wire.autopilots`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final, assert_never

from server.operations.core.flying import bodies
from server.operations.core.flying.vehicle import StateNotRestored, Vehicle
from server.operations.core.operation import Lane, Order, Step
from wire.autopilots import commands, payload_commands
from wire.autopilots.commands import CommandStep, Steps
from wire.autopilots.pilot_command import PilotCommand
from wire.dialect import mavlink
from wire.transactions import Outcome

ANSWER_WITHIN_S: Final = 8.0
"""Four tries of the agent, and what is left for a last answer. Later than that it must not be carried out."""

_SIMPLE: Final[dict[str, PilotCommand]] = {
    "hold": commands.Hold(),
    "land": commands.Land(),
    "pause": commands.Pause(),
    "resume": commands.Resume(),
    "rtl": commands.Return(),
}
_ZOOM: Final = {"in": 1, "out": -1, "stop": 0}
_STOPS: Final = (commands.Disarm, commands.Hold, commands.Land, commands.Pause, commands.Return)


def order_of(body: bodies.OneOff, vehicle: Vehicle) -> Order:
    """Raises NotKnownHow, NotKnownYet, NoSuchMode, NoSuchItem, StateNotRestored."""
    about: dict[str, object] = body.model_dump(exclude_none=True)

    def result_text(step: Step, outcome: Outcome, words: str, seen: bool | None) -> str:
        if outcome is Outcome.DONE and seen is None:
            return f"{vehicle.name} accepted, now {step.phase}."
        return f"{vehicle.name}, {step.phase}: {words}"

    command = command_of(body)
    said = vehicle.steps(command)
    if isinstance(body, bodies.Start | bodies.Jump) and body.item and not body.as_it_is:
        said = _with_state(body.item, said, vehicle)
    elif isinstance(command, commands.Resume):
        said = _resumed(said, vehicle)
    return Order(
        "command",
        Lane.COMMANDS,
        [step_of(one) for one in said],
        writes=True,
        overrules=commands.overrules(command, said),
        stops=isinstance(command, _STOPS),
        result_text=result_text,
        about=about,
    )


def _with_state(item: int, said: Steps, vehicle: Vehicle) -> Steps:
    """Sets again what earlier items have set: the camera before the mission flies, its speed once it does."""
    state = vehicle.mission_state(item)
    if state.lacking:
        raise StateNotRestored(
            f"{vehicle.name} would fly from item {item + 1} without what earlier items set, as the tower does not set "
            f"it again: {', '.join(state.lacking)} (`as_it_is` flies so)"
        )
    return (*said[:-1], *state.before, said[-1], *_flying(state.after))


def _resumed(said: Steps, vehicle: Vehicle) -> Steps:
    """A change of mode forgets what the mission had set. What else it moved is still where it is."""
    changes_mode = any(one.work.command == mavlink.MAV_CMD_DO_SET_MODE for one in said)
    if not changes_mode or not vehicle.current_item or vehicle.plan.packed is None:
        return said
    state = vehicle.mission_state(vehicle.current_item)
    return (*said, *_flying((*state.before, *state.after)))


def _flying(steps: Steps) -> Steps:
    """The mission flies already: their failure does not keep it on the ground."""
    return tuple(replace(step, item=None) for step in steps)


def step_of(said: CommandStep) -> Step:
    """For an order."""
    return Step(said.work, ANSWER_WITHIN_S, said.phase, skip=lambda: said.needless, item=said.item)


def command_of(body: bodies.OneOff) -> PilotCommand:
    """The plain value of a request."""
    match body:
        case bodies.Arm():
            return commands.Arm()
        case bodies.Disarm():
            return commands.Disarm(body.force)
        case bodies.ChangeMode():
            return commands.ChangeMode(body.mode)
        case bodies.TakeOff():
            return commands.TakeOff(body.height_m)
        case bodies.GoTo():
            return commands.GoTo(body.lat, body.lon, body.height_m, body.speed_m_s, body.heading_deg)
        case bodies.Simple():
            return _SIMPLE[body.command]
        case bodies.SetHome():
            place = None if body.lat is None or body.lon is None else (body.lat, body.lon)
            return commands.SetHome(place, body.altitude_m)
        case bodies.ChangeSpeed():
            return commands.ChangeSpeed(body.m_s)
        case bodies.Turn():
            return commands.Turn(body.deg, body.relative)
        case bodies.Start():
            return commands.StartMission(body.item)
        case bodies.Jump():
            return commands.Jump(body.item)
        case bodies.Orbit():
            return commands.Orbit(body.lat, body.lon, body.radius_m, body.height_m, body.m_s)
        case bodies.LookAt():
            if body.lat is None or body.lon is None or body.height_m is None:
                return commands.LookAt()
            return commands.LookAt((body.lat, body.lon, body.height_m))
        case bodies.SetServo():
            return payload_commands.SetServo(body.servo, body.pulse_us)
        case bodies.MoveGripper():
            return payload_commands.MoveGripper(body.action == "grab", body.gripper)
        case bodies.PointGimbal():
            return payload_commands.PointGimbal(body.pitch_deg, body.yaw_deg, body.locked)
        case bodies.ZoomCamera():
            return payload_commands.ZoomCamera(body.component, body.percent, _ZOOM[body.direction or "stop"])
        case bodies.TakePhotos():
            return payload_commands.TakePhotos(body.component, body.count, body.every_s, body.stop)
        case bodies.RecordVideo():
            return payload_commands.RecordVideo(body.component, body.on)
        case bodies.Calibrate():
            return commands.Calibrate(body.sensor)
        case bodies.CalibrationPose():
            return commands.CalibrationPose(body.pose)
        case bodies.EndCalibration():
            return commands.EndCalibration(body.keep)
        case bodies.SpinMotor():
            return commands.SpinMotor(body.motor, body.throttle_percent, body.for_s)
        case bodies.Reboot():
            return commands.Reboot()
        case _:
            assert_never(body)
