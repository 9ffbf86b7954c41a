"""When work for strangers may take the event loop: a slice, then a rest in which frames move. Pure."""

from __future__ import annotations


class Slices:
    """Never more than `slice_s` of work without `rest_s` between, both in seconds. Tell it what was used."""

    def __init__(self, slice_s: float, rest_s: float) -> None:
        self._slice_s = slice_s
        self._rest_s = rest_s
        self._left_s = slice_s
        self._began_at = float("-inf")

    def wait_s(self, now: float) -> float:
        """0 when something may be done now, else how long to rest."""
        until = self._began_at + self._slice_s + self._rest_s
        if now >= until:
            self._began_at, self._left_s = now, self._slice_s
        return 0.0 if self._left_s > 0 else until - now

    def used(self, took_s: float) -> None:
        self._left_s -= took_s
