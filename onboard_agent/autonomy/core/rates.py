"""Measures how often set-points go out, directions come in and pictures are taken: rates that do not depend on each
other. Pure."""


class RateMeter:
    """Count into `sent` and `directed`; set `pictures` to the controller's own count."""

    def __init__(self, now: float) -> None:
        self.sent = 0
        self.directed = 0
        self.pictures = 0
        self._began_at = self._looked_at = now
        self._looked = (0, 0, 0)

    def recent(self, now: float) -> str:
        """Returns the rates since the last call, for people."""
        passed_s = max(now - self._looked_at, 1e-3)
        sent, directed = self.sent - self._looked[0], self.directed - self._looked[1]
        pictures = self.pictures - self._looked[2]
        self._looked_at, self._looked = now, (self.sent, self.directed, self.pictures)
        seen = f", {pictures / passed_s:.1f} pictures/s" if self.pictures else ""
        return f"{sent / passed_s:.1f} set-points/s, {directed / passed_s:.1f} directions/s{seen}"

    def words(self, now: float) -> str:
        """Returns the totals, for people."""
        return f"{self.sent} set-points and {self.directed} directions in {now - self._began_at:.0f} s."
