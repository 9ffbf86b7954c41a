"""What the refusals of alerts are in HTTP."""

from typing import Final

from server.alerts.core.refusals import MayNotAcknowledge, UnknownAlert
from server.alerts.store.channels.refusals import (
    BadAlertChannel,
    TooManyAlertChannels,
    TooManyBrowsers,
    TooManyMessages,
    UnknownAlertChannel,
)
from server.http.problem_kinds import Kind, Problems

PROBLEMS: Final[Problems] = {
    UnknownAlertChannel: Kind("unknown-alert-channel", 404, "No such alert channel"),
    TooManyAlertChannels: Kind("too-many-alert-channels", 409, "Too many alert channels"),
    TooManyBrowsers: Kind("too-many-browsers", 409, "Too many browsers with alerts"),
    BadAlertChannel: Kind("bad-alert-channel", 409, "The alert channel is not accepted"),
    TooManyMessages: Kind("too-many-tries", 429, "Too many tries"),
    UnknownAlert: Kind("unknown-alert", 404, "No such alert"),
    MayNotAcknowledge: Kind("only-watches", 403, "You may only watch"),
}
