"""What the refusals of video are in HTTP."""

from typing import Final

from server.http.problem_kinds import Kind, Problems
from server.video.core.recordings.refusals import (
    AlreadyRecording,
    NotReady,
    NotYourRecording,
    NotYoursToRecord,
    NoVideo,
    RecordingBusy,
    RecordingStorageFull,
    TooManyRecordings,
    UnknownRecording,
)

PROBLEMS: Final[Problems] = {
    UnknownRecording: Kind("unknown-recording", 404, "No such recording"),
    NotReady: Kind("recording-not-ready", 409, "There is no file yet"),
    NotYoursToRecord: Kind("not-in-control", 409, "You do not have the controls"),
    NotYourRecording: Kind("not-your-recording", 403, "Not your recording"),
    AlreadyRecording: Kind("already-recording", 409, "It is being recorded already"),
    TooManyRecordings: Kind("too-many-recordings", 409, "Too many recordings"),
    RecordingBusy: Kind("recording-busy", 409, "It is not over yet"),
    NoVideo: Kind("no-video", 409, "There is no video"),
    RecordingStorageFull: Kind("no-room", 413, "No space left"),
}
