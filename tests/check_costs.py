"""Compares what the short tier costs with what it cost when that was written down (`costs.json` beside this file).

    python tests/check_costs.py             # part of `make check`: warns when the last `make test` here cost 2 % more
    python tests/check_costs.py --accept    # writes down the costs of the last run

A busy or slow machine costs more of everything, so the costs are compared as shares: of the modules that both runs
have, the median says how much slower this machine was. Only what stands out of the noise counts as a change: a module
is new or gone, or it costs half as much again, or half, and a second more or less.
"""

import argparse
import json
import statistics
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Final

sys.path.insert(0, str(Path(__file__).resolve().parent))

from worlds.costs import WALL, sum_of

KNOWN: Final = Path(__file__).with_name("costs.json")
LAST: Final = Path(__file__).resolve().parents[1] / ".pytest_cache" / "costs.json"
MAX_GROWTH: Final = 0.02
NOISE: Final = 1.5
"""Times as much, or as little."""
NOISE_S: Final = 1.0

Costs = Mapping[str, Mapping[str, float]]


def growth(known: Costs, now: Costs) -> tuple[float, dict[str, float]]:
    """Returns the growth of the sum as a share of it, and the seconds by which each changed module grew or shrank, at
    the pace of the machine where the known costs were measured."""
    before = {module: sum_of(costs) for module, costs in known.items()}
    after = {module: sum_of(costs) for module, costs in now.items()}
    paces = [after[module] / before[module] for module in before.keys() & after.keys() if before[module] >= NOISE_S]
    pace = statistics.median(paces) if paces else 1.0
    changed: dict[str, float] = {}
    for module in before.keys() | after.keys():
        was_s, is_s = before.get(module, 0.0), after.get(module, 0.0) / pace
        is_noise = was_s / NOISE < is_s < was_s * NOISE or abs(is_s - was_s) < NOISE_S
        if not is_noise:
            changed[module] = is_s - was_s
    total_s = sum(before.values())
    return (sum(changed.values()) / total_s if total_s else 0.0), changed


def accept(now: Costs) -> None:
    """Writes down what each module cost, and how long it took."""
    kept = {
        module: {"cpu": round(sum_of(costs), 1), WALL: round(costs.get(WALL, 0.0), 1)}
        for module, costs in sorted(now.items())
        if module.startswith("tests/")
    }
    lines = [f"  {json.dumps(module)}: {json.dumps(costs)}" for module, costs in kept.items()]
    KNOWN.write_text("{\n" + ",\n".join(lines) + "\n}\n")


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--accept", action="store_true")
    is_accepting = parser.parse_args().accept
    if not LAST.exists():
        if is_accepting:
            print("nothing was measured here: run `make test` first", file=sys.stderr)
        return int(is_accepting)
    now: Costs = {
        module: costs for module, costs in json.loads(LAST.read_text()).items() if module.startswith("tests/")
    }
    if is_accepting:
        accept(now)
        return 0
    share, changed = growth(json.loads(KNOWN.read_text()), now)
    if share > MAX_GROWTH:
        print(f"warning: the last `make test` here cost {share:.1%} more processor time than tests/costs.json says:")
        for module, seconds in sorted(changed.items(), key=lambda one: -one[1])[:10]:
            print(f"  {seconds:+7.1f} s  {module}")
        print("Make it cheaper, or write the costs down with `python tests/check_costs.py --accept`.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
