"""What a monitor may see of the machine that it watches. The truth about the body is not among it."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import numpy.typing as npt

from simulator.control.cascade import Cascade
from simulator.control.reference import Reference
from simulator.estimation.navigation_filter import NavigationFilter
from simulator.sensors.board import SensorBoard


class Watched(Protocol):
    count: int
    now_s: float
    board: SensorBoard
    filter: NavigationFilter
    cascade: Cascade
    reference: Reference | None
    armed: npt.NDArray[np.bool_]
    landed: npt.NDArray[np.bool_]
