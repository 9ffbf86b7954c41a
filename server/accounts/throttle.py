"""How fast somebody may try passwords: a few at once, then with waits that double. A core: `now` is passed in.

Three counts for each try: of the name from this address (whoever mistypes), of the address whatever the name (whoever
tries one password on many names), of the name from wherever (whoever has many addresses). The last one makes nobody
wait long: it must not become a way to keep somebody else out.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from typing import Final

FREE_TRIES: Final = 5
"""People mistype; nobody waits before this many failures."""
FREE_TRIES_OF_ADDRESS: Final = 50
"""A whole office may come from one address, in the morning."""
FREE_TRIES_OF_NAME: Final = 30
FIRST_WAIT_S: Final = 1.0
LONGEST_WAIT_S: Final = 300.0
LONGEST_WAIT_OF_NAME_S: Final = 15.0
FORGOTTEN_AFTER_S: Final = 900.0
"""Longer than the longest wait: waiting it out does not clear the count."""
MOST_ENTRIES: Final = 30_000
"""Whoever sprays names can push the oldest out, not grow the memory."""

_Key = tuple[str, str]


@dataclass
class _Tries:
    failures: int
    last_s: float
    open_at_s: float


class SignInThrottle:
    """Counts a try as failed when it begins, so that a hundred at the same moment are a hundred failures."""

    def __init__(self) -> None:
        self._tries: OrderedDict[_Key, _Tries] = OrderedDict()

    def __len__(self) -> int:
        return len(self._tries)

    def begin(self, *, name: str, address: str, now_s: float) -> float:
        """0 when the try may go on (it is then counted), else how many seconds to wait."""
        bounds = (
            ((name, address), FREE_TRIES, LONGEST_WAIT_S),
            (("", address), FREE_TRIES_OF_ADDRESS, LONGEST_WAIT_S),
            ((name, ""), FREE_TRIES_OF_NAME, LONGEST_WAIT_OF_NAME_S),
        )
        wait_s = max(self._wait_s(key, now_s) for key, _, _ in bounds)
        if wait_s > 0:
            return wait_s
        for key, free, longest_s in bounds:
            self._count(key, free, longest_s, now_s)
        while len(self._tries) > MOST_ENTRIES:
            self._tries.popitem(last=False)
        return 0.0

    def succeeded(self, *, name: str, address: str) -> None:
        """The name is cleared; of the address only this try: whoever has an account must not clear it for others."""
        self._tries.pop((name, address), None)
        self._tries.pop((name, ""), None)
        of_address = self._tries.get(("", address))
        if of_address is not None:
            of_address.failures = max(0, of_address.failures - 1)
            if of_address.failures < FREE_TRIES_OF_ADDRESS:
                of_address.open_at_s = float("-inf")

    def _wait_s(self, key: _Key, now_s: float) -> float:
        tries = self._tries.get(key)
        if tries is None or now_s - tries.last_s >= FORGOTTEN_AFTER_S:
            return 0.0
        return tries.open_at_s - now_s

    def _count(self, key: _Key, free: int, longest_s: float, now_s: float) -> None:
        tries = self._tries.get(key)
        if tries is None or now_s - tries.last_s >= FORGOTTEN_AFTER_S:
            tries = _Tries(failures=0, last_s=now_s, open_at_s=now_s)
        tries.failures += 1
        tries.last_s = now_s
        beyond = tries.failures - free
        if beyond >= 0:
            tries.open_at_s = now_s + min(FIRST_WAIT_S * 2.0 ** min(beyond, 20), longest_s)
        self._tries[key] = tries
        self._tries.move_to_end(key)
