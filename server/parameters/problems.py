"""What the refusals of parameters are in HTTP."""

from typing import Final

from server.http.problem_kinds import Kind, Problems
from server.parameters.core.metadata import NoMetadata
from server.parameters.core.orders import ParametersUnknown

PROBLEMS: Final[Problems] = {
    ParametersUnknown: Kind("parameters-unknown", 409, "The parameters are not known yet"),
    NoMetadata: Kind("no-metadata", 404, "The vehicle offers no parameter metadata"),
}
