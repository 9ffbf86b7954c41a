"""The black box of a drone whose agent is killed: at most the last second is lost, and the file opens."""

import os
import random
import subprocess
import sys
import time
from pathlib import Path

from onboard_agent.black_box.flight_files import TLOG, entries_in

KILLS = int(os.environ.get("BLACK_BOX_KILLS", "3"))
RATE_HZ = 200
_PROGRAM = """
import sys, time
from pathlib import Path
from onboard_agent.black_box.service import BlackBox
from wire.dialect import build, mavlink

box = BlackBox(Path(sys.argv[1]), 100, time.monotonic())
box.start()
number = 0
while True:
    number += 1
    message = mavlink.MAVLink_attitude_message(number, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
    now = time.monotonic()
    box.add([build(message, system_id=1, component_id=1, sequence=number)], now)
    box.tick(now, armed=True, heard=True)
    print(number, flush=True)
    time.sleep(1 / float(sys.argv[2]))
"""


def test_a_kill_costs_at_most_a_second(tmp_path: Path) -> None:
    chance = random.Random(20)
    worst_s = 0.0
    for _ in range(KILLS):
        begun = set(tmp_path.glob(f"*{TLOG}"))
        command = [sys.executable, "-c", _PROGRAM, str(tmp_path), str(RATE_HZ)]
        with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
            assert process.stdout is not None
            process.stdout.readline()
            until = time.monotonic() + chance.uniform(0.8, 2.0)
            while time.monotonic() < until:
                process.stdout.readline()
            process.kill()
            killed_at_us = time.time_ns() // 1000
        (tlog,) = set(tmp_path.glob(f"*{TLOG}")) - begun
        entries = list(entries_in(tlog))
        assert entries, "there is a recording"
        lost_s = (killed_at_us - entries[-1][0]) / 1e6
        worst_s = max(worst_s, lost_s)
        assert lost_s <= 1.0
    print(f"{KILLS} kills, at most {worst_s:.2f} s lost")
