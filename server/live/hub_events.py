"""Events that the hub notices and others handle, in the past tense. The hub never waits for them."""

from dataclasses import dataclass
from typing import Final, Literal

from server.kernel.restraint import Measure
from wire.control_messages import HoldProgress, LossParameters
from wire.ids import DroneId, UserId


@dataclass(frozen=True)
class HolderGone:
    """The holder was flying by hand and has had no live browser for `for_s` seconds."""

    drone_id: DroneId
    user_id: UserId
    for_s: float


@dataclass(frozen=True)
class HolderExpired:
    """The holder has had no live browser for the whole grace time."""

    drone_id: DroneId
    user_id: UserId


NOT_OF_ITS_TEAM: Final = "no longer a pilot of its team"
"""A reason of RightLost."""


@dataclass(frozen=True)
class RightLost:
    """An account that has a part in the lease may not have it any more: disabled, no longer an owner, signed out."""

    drone_id: DroneId
    user_id: UserId
    whose: Literal["holder", "taken_from", "assistant"]
    reason: str


@dataclass(frozen=True)
class TurnRequested:
    """While an admin assists: whose frames are to pass from now on."""

    drone_id: DroneId
    whose: Literal["holder", "assistant"]


@dataclass(frozen=True)
class OfferLapsed:
    """Nobody accepted the controls in time."""

    drone_id: DroneId


@dataclass(frozen=True)
class RttTooLong:
    """The round trip from the flying browser to the drone was above the drone's limit for too long."""

    drone_id: DroneId
    rtt_ms: float


@dataclass(frozen=True)
class HoldStepReported:
    """The agent tells how a hold goes on. `reason` is that of the order, or empty for the agent's own holds."""

    drone_id: DroneId
    progress: HoldProgress
    reason: str


@dataclass(frozen=True)
class HoldToKeep:
    """Whether a hold must be ordered again on the drone's next link has changed."""

    drone_id: DroneId


@dataclass(frozen=True)
class LossParametersReported:
    """The agent has read what decides on a loss."""

    drone_id: DroneId
    parameters: LossParameters


@dataclass(frozen=True)
class ControlsMoved:
    """Another process changed the lease: seen in the database, not reported by this tower's service."""

    drone_id: DroneId


@dataclass(frozen=True)
class AgentLinked:
    """An agent has signed in."""

    drone_id: DroneId


@dataclass(frozen=True)
class LoanLimitPassed:
    """A borrower flies by hand beyond the limits of the loan. `why` is in words."""

    drone_id: DroneId
    user_id: UserId
    why: str


@dataclass(frozen=True)
class ZoneReached:
    """A drone that is flown by hand is about to enter a zone, or goes deeper into it. `why` is in words."""

    drone_id: DroneId
    user_id: UserId | None
    zone_id: int
    zone: str
    why: str


@dataclass(frozen=True)
class SeparationLost:
    """Two drones are about to be nearer to each other than is safe: a warning was given. Metres and seconds,
    predicted."""

    drone_id: DroneId
    other_id: DroneId
    in_s: float
    horizontal_m: float
    vertical_m: float


@dataclass(frozen=True)
class MotionSuspected:
    """An armed drone does not move as a machine can. `why`: `jump`, `speed`, `height`, `course`."""

    drone_id: DroneId
    why: str


@dataclass(frozen=True)
class StickGestureHeldBack:
    """Somebody tried to arm or to disarm by sticks, and the agent kept it from the autopilot. `user_id`: whose frames
    passed then; None: nobody's any more. `number`: counts those of this agent since it started."""

    drone_id: DroneId
    user_id: UserId | None
    airborne: bool
    number: int


@dataclass(frozen=True)
class MotorsStopped:
    """A drone was disarmed in the air, by whatever hand. `where`: words with its height."""

    drone_id: DroneId
    where: str


@dataclass(frozen=True)
class NoiseJudged:
    """A drone sends more than its share, or no longer: what the tower does about that by itself; empty: nothing more.
    `words`: what it sends."""

    drone_id: DroneId
    measures: frozenset[Measure]
    words: str


HubEvent = (
    LoanLimitPassed
    | StickGestureHeldBack
    | MotorsStopped
    | NoiseJudged
    | ZoneReached
    | AgentLinked
    | HolderGone
    | HolderExpired
    | RightLost
    | TurnRequested
    | OfferLapsed
    | RttTooLong
    | HoldStepReported
    | HoldToKeep
    | LossParametersReported
    | ControlsMoved
    | SeparationLost
    | MotionSuspected
)
