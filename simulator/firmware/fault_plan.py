"""Faults of the first vehicle of a fleet at given times: `--fault` of `tower-sim shell` and `tower-sim fly`."""

from __future__ import annotations

from collections.abc import Iterable

from simulator.firmware import faults
from simulator.firmware.controller import Fleet
from simulator.firmware.fault_table import FaultName, parse


class FaultPlan:
    def __init__(self, texts: Iterable[str] = ()) -> None:
        """Raises ValueError, as `fault_table.parse` does."""
        parsed = [parse(text) for text in texts]
        self._all: list[tuple[float, bool, FaultName]] = sorted(
            event for name, from_s, until_s in parsed for event in ((from_s, True, name), (until_s, False, name))
        )
        """(second, begins or ends, name)."""
        self._next = 0

    def restart(self) -> None:
        """For a fleet that was switched off and on."""
        self._next = 0

    def apply(self, fleet: Fleet) -> None:
        """Called before each step."""
        while self._next < len(self._all) and self._all[self._next][0] <= fleet.now_s + 1e-9:
            _, begins, name = self._all[self._next]
            self._next += 1
            if begins:
                faults.begin(fleet, name)
            else:
                faults.end(fleet, name)
