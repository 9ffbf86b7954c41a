"""What proves that an autopilot is simulated: a loss may then be rehearsed in flight without further questions."""

import pytest

from server.control.simulated import is_simulator
from wire.control_messages import LossParameters


@pytest.mark.parametrize(
    ("autopilot", "values", "simulated"),
    [
        ("ardupilot", {"SIM_SPEEDUP": 1.0}, True),
        ("ardupilot", {"SIM_SPEEDUP": -1.0}, True),
        ("ardupilot", {"FS_GCS_ENABLE": 1.0}, False),
        ("px4", {"SYS_HITL": 0.0, "SIM_GZ_EN": 1.0}, True),
        ("px4", {"SYS_HITL": 1.0}, True),
        ("px4", {"SYS_HITL": 2.0}, True),
        # A PX4 on a real board has these as well, switched off.
        ("px4", {"SYS_HITL": 0.0, "SIM_BAT_DRAIN": 60.0}, False),
        ("px4", {"SYS_HITL": -1.0}, False),
        ("", {}, False),
    ],
)
def test_a_simulated_autopilot_is_known_by_its_parameters(
    autopilot: str, values: dict[str, float], simulated: bool
) -> None:
    assert is_simulator(LossParameters(autopilot=autopilot, values=values, complete=True)) is simulated


def test_nothing_told_proves_nothing() -> None:
    assert not is_simulator(None)
