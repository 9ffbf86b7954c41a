"""What the refusals of fleet are in HTTP."""

from typing import Final

from server.fleet.core.update_refusals import FlownByAnother, UnknownRelease
from server.fleet.io.tower_address import AddressUnknown
from server.fleet.store.drones import DroneNameTaken
from server.fleet.store.enrolments import BadDroneKey, BadEnrolment, UnknownEnrolment
from server.fleet.store.loans import BadLoan, OwnerAlready
from server.http.problem_kinds import INVALID, Kind, Problems

PROBLEMS: Final[Problems] = {
    UnknownEnrolment: Kind("unknown-enrolment", 404, "No such enrolment"),
    AddressUnknown: Kind("address-unknown", 409, "The tower's own address is not known"),
    BadDroneKey: Kind("bad-drone-key", 403, "The key is not valid"),
    BadEnrolment: Kind("bad-enrolment", 403, "The enrolment token is not valid"),
    OwnerAlready: Kind("owner-already", 409, "The user owns the drone"),
    BadLoan: INVALID.at("until"),
    DroneNameTaken: Kind("name-taken", 409, "The name is taken"),
    UnknownRelease: Kind("unknown-release", 404, "No such release of the agent"),
    FlownByAnother: Kind("flown-by-another", 409, "Somebody has the controls"),
}
