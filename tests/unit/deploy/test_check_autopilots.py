"""The check that finds autopilots named outside their profiles."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[3] / "deploy"))

from check_autopilots import names_in_python, names_in_typescript

PYTHON = '''"""Measured on ArduCopter."""
# PX4 answers late
if family == "px4":
    return mavlink.MAV_AUTOPILOT_PX4
def ardupilot_words(): ...
if kind == mavlink.MAV_AUTOPILOT_INVALID:
    """PX4 has none."""
from wire.autopilots.arducopter import TURTLE
has_sub_modes = 1
mavlink.enums["COPTER_MODE"]
'''
TYPESCRIPT = """/** ArduPilot's limit.
 */
const family = 'ardupilot'; // as PX4 has it
type Kind = 'px4' | 'other';
<!-- ArduPilot -->
const url = 'https://example.org/px4';
"""


def test_code_is_searched_and_comments_are_not() -> None:
    assert sorted(set(names_in_python(PYTHON))) == [3, 4, 5, 8, 10]
    assert list(names_in_typescript(TYPESCRIPT)) == [3, 4, 6]
