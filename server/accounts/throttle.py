"""How fast somebody may try passwords: a few at once, then with waits that double. A core: `now` is passed in."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from typing import Final

FREE_TRIES: Final = 5
"""People mistype; nobody waits before this many failures."""
FIRST_WAIT_S: Final = 1.0
LONGEST_WAIT_S: Final = 300.0
FORGOTTEN_AFTER_S: Final = 900.0
"""Longer than the longest wait: waiting it out does not clear the count."""
MOST_ENTRIES: Final = 10_000
"""Whoever sprays names can push the oldest out, not grow the memory."""


@dataclass
class _Tries:
    failures: int
    last_s: float
    open_at_s: float


class SignInThrottle:
    """Counts a try as failed when it begins, so that a hundred at the same moment are a hundred failures."""

    def __init__(self) -> None:
        self._tries: OrderedDict[tuple[str, str], _Tries] = OrderedDict()

    def __len__(self) -> int:
        return len(self._tries)

    def begin(self, *, name: str, address: str, now_s: float) -> float:
        """0 when the try may go on (it is then counted), else how many seconds to wait."""
        key = (name, address)
        tries = self._tries.get(key)
        if tries is None or now_s - tries.last_s >= FORGOTTEN_AFTER_S:
            tries = _Tries(failures=0, last_s=now_s, open_at_s=now_s)
        if now_s < tries.open_at_s:
            return tries.open_at_s - now_s
        tries.failures += 1
        tries.last_s = now_s
        beyond = tries.failures - FREE_TRIES
        if beyond >= 0:
            tries.open_at_s = now_s + min(FIRST_WAIT_S * 2.0 ** min(beyond, 20), LONGEST_WAIT_S)
        self._tries[key] = tries
        self._tries.move_to_end(key)
        while len(self._tries) > MOST_ENTRIES:
            self._tries.popitem(last=False)
        return 0.0

    def succeeded(self, *, name: str, address: str) -> None:
        self._tries.pop((name, address), None)
