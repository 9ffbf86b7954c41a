"""What a flight tells people: progress with its measured rates, what was found, sentences for STATUSTEXT. No I/O."""

from typing import Final

from onboard_agent.autonomy.core.lines import Beat, Found, Note, VideoBox
from onboard_agent.autonomy.core.rates import RateMeter
from wire.findings import InVideo, TargetFound
from wire.transactions import TransactionProgress, TransactionToTower

REPORT_EVERY_S: Final = 1.0
SIGHTINGS_APART_S: Final = 0.2
"""More is no news for the eye."""
MAX_PICTURE_AGE_S: Final = 60.0


class FlightReports:
    """`name`: the controller's. `deadline`: when its time is over."""

    def __init__(self, transaction_id: int, name: str, now: float, deadline: float) -> None:
        self.meter = RateMeter(now)
        self.warnings: list[str] = []
        """For STATUSTEXT."""
        self._id = transaction_id
        self._name = name
        self._began_at = self._reported_at = now
        self._deadline = deadline
        self._note = ""
        self._sighted_at = float("-inf")
        self._reports: list[TransactionToTower] = []

    def said(self, report: Beat | Note | Found, now: float) -> None:
        """Takes what the controller says beside its directions."""
        match report:
            case Beat(pictures=pictures):
                self.meter.pictures = max(self.meter.pictures, pictures)
            case Note(words=words, aloud=aloud):
                self._note = words
                if aloud:
                    self.warnings.append(f"{self._name}: {words}")
            case Found():
                self._found(report, now)

    def _found(self, one: Found, now: float) -> None:
        # NaN fails each comparison.
        if not (abs(one.lat_deg) <= 90.0 and abs(one.lon_deg) <= 180.0 and 0.0 <= one.confidence <= 1.0):
            self.warnings.append(f"{self._name} reported a place that does not exist")
            return
        if one.sighting:
            if one.in_video is None or now - self._sighted_at < SIGHTINGS_APART_S:
                return
            self._sighted_at = now
        self._reports.append(
            TargetFound(
                id=self._id,
                letter=one.letter,
                confidence=one.confidence,
                lat_deg=one.lat_deg,
                lon_deg=one.lon_deg,
                thumbnail=one.thumbnail,
                in_video=None if one.in_video is None else _in_video(one.in_video, now),
                sighting=one.sighting,
            )
        )

    def tick(self, phase: str, now: float) -> None:
        """Makes a progress report once a second. `phase`: shown unless the controller has said what it does."""
        if now - self._reported_at < REPORT_EVERY_S:
            return
        self._reported_at = now
        done, total = round(now - self._began_at), round(self._deadline - self._began_at)
        words = f"{self._name}, {self._note or phase}: {self.meter.recent(now)}"
        self._reports.append(TransactionProgress(id=self._id, phase=words, done=done, total=total))

    def pop(self) -> list[TransactionToTower]:
        """Returns the messages for the tower once, in order."""
        reports, self._reports = self._reports, []
        return reports

    def pop_warnings(self) -> list[str]:
        """Returns the sentences for STATUSTEXT once."""
        warnings, self.warnings = self.warnings, []
        return warnings


def _in_video(one: VideoBox, now: float) -> InVideo | None:
    """Returns None for a box that is none, or for a picture from nowhen."""
    shares = (one.x, one.y, one.width, one.height)
    age_s = now - one.taken_s
    if not (all(0.0 <= share <= 1.0 for share in shares) and age_s <= MAX_PICTURE_AGE_S):
        return None
    return InVideo(x=one.x, y=one.y, width=one.width, height=one.height, age_s=max(age_s, 0.0))
