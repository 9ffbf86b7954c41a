"""What the refusals of flights are in HTTP."""

from typing import Final

from server.flights.core.imports.refusals import BadFlightFile, ImportsFull, UnknownImport
from server.flights.core.refusals import BadPage, FlightElsewhere, FlightRunning, NotIdentified, UnknownFlight
from server.flights.core.videos.refusals import FlightVideoNotMade, FlightVideosBusy
from server.http.problem_kinds import Kind, Problems

PROBLEMS: Final[Problems] = {
    UnknownFlight: Kind("unknown-flight", 404, "No such flight"),
    UnknownImport: Kind("unknown-import", 404, "No such imported flight"),
    BadFlightFile: Kind("bad-flight-file", 422, "The file cannot be imported"),
    ImportsFull: Kind("imports-full", 409, "No room for another flight"),
    FlightElsewhere: Kind("flight-elsewhere", 409, "Its files are elsewhere"),
    FlightRunning: Kind("flight-running", 409, "It is not over yet"),
    FlightVideosBusy: Kind("flight-videos-busy", 409, "Another video is being made"),
    FlightVideoNotMade: Kind("flight-video-not-made", 404, "No such video"),
    NotIdentified: Kind("not-identified", 422, "The flight cannot be identified"),
    BadPage: Kind("bad-page", 422, "No such page"),
}
