"""How many of the product's own functions one frame calls, and in how many files they are.

    python -m bench calls                 # a table
    python -m bench calls --case agent    # and each function of these, in the order of its first call

A newcomer reads as many files as a frame passes through. Counted with `sys.setprofile` in the real agent and the real
tower without sockets: a drone that is flown by hand, its links up.
"""

from __future__ import annotations

import argparse
import random
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Final

from bench.fuzz_agent_core import AgentCore
from bench.fuzz_tower_core import TowerCore
from bench.rows import Report
from wire.dialect import build, mavlink

CHECKOUT: Final = Path(__file__).resolve().parents[1]
OURS: Final = ("server", "onboard_agent", "wire")
ATTITUDE: Final = build(
    mavlink.MAVLink_attitude_message(1000, 0.1, 0.0, 0.5, 0, 0, 0), system_id=1, component_id=1, sequence=9
)
HEARTBEAT: Final = build(
    mavlink.MAVLink_heartbeat_message(2, 3, 0x81, 5, 4, 3), system_id=1, component_id=1, sequence=8
)
STICKS: Final = build(
    mavlink.MAVLink_manual_control_message(1, 100, 0, 500, 0, 0), system_id=255, component_id=190, sequence=9
)


def calls_of(act: Callable[[], object]) -> Counter[str]:
    """Returns the functions of ours that `act` calls (`file:function`), and how often."""
    found: Counter[str] = Counter()

    def note(frame: FrameType, event: str, _argument: object) -> None:
        if event == "call":
            code = frame.f_code
            path = Path(code.co_filename)
            if path.is_relative_to(CHECKOUT) and path.relative_to(CHECKOUT).parts[0] in OURS:
                found[f"{path.relative_to(CHECKOUT)}:{code.co_qualname}"] += 1

    sys.setprofile(note)
    try:
        act()
    finally:
        sys.setprofile(None)
    return found


async def cases() -> dict[str, Counter[str]]:
    """Returns for each case the functions called, and how often. Call it inside a running event loop."""
    chance = random.Random(44)
    found = {}
    agent = AgentCore(chance)
    for _ in range(3):
        agent.rest()
    stick = agent.fuzzer.seal(agent.fuzzer.frames_content([STICKS]))
    agent.deliver(agent.fuzzer.seal(agent.fuzzer.frames_content([STICKS])))
    found["agent: a stick"] = calls_of(lambda: agent.deliver(stick))
    agent.from_autopilot(ATTITUDE)
    found["agent: an attitude"] = calls_of(lambda: agent.from_autopilot(ATTITUDE))
    tower = TowerCore(chance)
    sealed = [tower.fuzzer.seal(tower.fuzzer.frames_content([frame])) for frame in (HEARTBEAT, ATTITUDE, ATTITUDE)]
    for one in sealed[:2]:
        tower.from_agent(one)
    found["tower: an attitude"] = calls_of(lambda: tower.from_agent(sealed[2]))
    assert tower.from_browser(STICKS), "its pilot flies it"
    found["tower: a stick"] = calls_of(lambda: tower.from_browser(STICKS))
    return found


async def run(report: Report, args: argparse.Namespace) -> None:
    """Counts the calls of a stick and of an attitude, at the agent and at the tower."""
    for case, calls in (await cases()).items():
        report.add(case, "calls", sum(calls.values()), "count")
        report.add(case, "files", len({name.partition(":")[0] for name in calls}), "count")
        if any(wanted in case for wanted in args.case or ()):
            report.say(f"{case}:\n" + "\n".join(f"{count:5} {name}" for name, count in calls.items()))
