"""Why nothing is recorded, or a recording is not given out. Knows nothing of HTTP."""

from server.kernel.refusal import Refusal


class UnknownRecording(Refusal):
    """Never was, deleted, or removed to make room."""

    def __init__(self) -> None:
        super().__init__("there is no such recording: it may have been removed to make room")


class NotReady(Refusal):
    """There is no file to download."""


class NotYoursToRecord(Refusal):
    def __init__(self, name: str) -> None:
        super().__init__(f"only whoever has the controls of {name}, or an admin, begins and ends its recordings")


class NotYourRecording(Refusal):
    def __init__(self, name: str) -> None:
        super().__init__(f"only an owner of {name} or an admin deletes its recordings")


class AlreadyRecording(Refusal):
    def __init__(self, name: str, quality: str) -> None:
        super().__init__(f"the {quality} video of {name} is being recorded already")


class TooManyRecordings(Refusal):
    def __init__(self) -> None:
        super().__init__("too many videos are being recorded now: end one first")


class RecordingBusy(Refusal):
    def __init__(self) -> None:
        super().__init__("it is still being recorded or processed: wait until it is ready")


class NoVideo(Refusal):
    """The drone has none to record."""


class RecordingStorageFull(Refusal):
    """Neither budget nor disk have room."""
