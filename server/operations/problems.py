"""What the refusals of operations are in HTTP."""

from typing import Final

from server.http.problem_kinds import INVALID, Kind, Problems
from server.operations.core.controller_forms import BadControllerSetting
from server.operations.core.flying.following import CannotFollow, NoSuchLeader
from server.operations.core.flying.land_at import NotInTheAir
from server.operations.core.flying.on_the_ground import NoSuchMotor, NotOnTheGround, PropellersNotConfirmed
from server.operations.core.flying.vehicle import NoSuchItem, NoSuchMode, NotKnownHow, NotKnownYet, StateNotRestored
from server.operations.core.refusals import (
    AgentTooOld,
    Assisted,
    DroneBusy,
    DroneOffline,
    LoanForbids,
    LossCheckOpen,
    MovesHome,
    NotInControl,
    NotThroughTheTower,
    OnlyWatches,
    OutsideOwnFence,
    TooManyOperations,
    TurnTimeout,
    UnknownOperation,
    ViewTaken,
    WouldFall,
    ZoneForbids,
)

PROBLEMS: Final[Problems] = {
    DroneOffline: Kind("drone-offline", 409, "The drone is offline"),
    AgentTooOld: Kind("agent-too-old", 409, "The drone's agent is too old"),
    TooManyOperations: Kind("too-many-operations", 429, "Too many requests"),
    DroneBusy: Kind("drone-busy", 409, "The drone is busy"),
    UnknownOperation: Kind("unknown-operation", 404, "No such operation"),
    NotInControl: Kind("not-in-control", 409, "You do not have the controls"),
    Assisted: Kind("assisted", 409, "An admin is assisting"),
    TurnTimeout: Kind("not-in-control", 409, "You do not have the controls"),
    LossCheckOpen: Kind("loss-check", 409, "The loss check is open"),
    NotThroughTheTower: Kind("not-allowed", 409, "Not through the tower"),
    WouldFall: Kind("would-fall", 409, "The drone would fall"),
    NotOnTheGround: Kind("not-on-the-ground", 409, "The drone is not on the ground"),
    NotInTheAir: Kind("not-in-the-air", 409, "The drone is not in the air"),
    PropellersNotConfirmed: Kind("propellers-not-confirmed", 409, "The propellers are not confirmed to be off"),
    NoSuchMotor: Kind("no-such-motor", 409, "No such motor"),
    MovesHome: Kind("moves-home", 409, "Home would move"),
    StateNotRestored: Kind("state-not-restored", 409, "What earlier items set is not set again"),
    ZoneForbids: Kind("zone", 409, "A zone is on the way"),
    OutsideOwnFence: Kind("outside-fence", 409, "Outside the autopilot's fence"),
    LoanForbids: Kind("loan", 409, "Beyond the limits of the loan"),
    ViewTaken: Kind("view-taken", 403, "The view was taken"),
    OnlyWatches: Kind("only-watches", 403, "You may only watch"),
    NotKnownHow: Kind("not-supported", 409, "Not supported by this vehicle"),
    NotKnownYet: Kind("not-known-yet", 409, "Not known yet"),
    NoSuchMode: INVALID.at("mode"),
    NoSuchItem: INVALID.at("item"),
    NoSuchLeader: INVALID.at("leader"),
    BadControllerSetting: INVALID,
    CannotFollow: Kind("cannot-follow", 409, "It cannot follow"),
}
