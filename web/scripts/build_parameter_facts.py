r"""Make the table of plain facts about an autopilot's parameters: units, ranges, defaults, restarts, choices, bits.

    python scripts/build_parameter_facts.py --defaults LIST oldest.json ... newest.json \
        > src/parameters/facts/NAME_metadata.json

The JSON files are what ArduPilot publishes of a release (apm.pdef.json) or PX4 (parameters.json, the form of MAVLink's
component metadata); the newest that knows a parameter tells of it. LIST has the defaults where the files do not:
NAME,VALUE as a vehicle has it before anybody changed it, or a table that this program made. Sentences are taken from
none of them: ours are in src/parameters/facts/*.ts, and parameter_labels.py has the words of choices.

Calibrations, identities, counters, and what hangs on the kind of board have no default. What is the same for every
number in a name stands once, with `#` for the number; lists that several parameters have stand once.
"""

import argparse
import json
import math
import re
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final, TypeVar

from parameter_labels import label

UNITS: Final = {"d%": "%/10", "ds": "s/10", "octal": "", "degC": "°C", "cdegC": "c°C", "PWM": "us", "norm": ""}
"""Those that we write in another way."""
OF_ONE_MACHINE: Final = re.compile(
    r"_(ID\d?|DEV_ID\d?|DEVID|OFFS_[XYZ]|SCAL_[XYZ]|CALTEMP|GND_PRESS|PIN\d?|CHECKSUM|SERIAL_NUM)$"
    r"|^(STAT|SIM|COMPASS_(OFS|DIA|ODI|MOT|PRIO|DEV)|INS_TCAL|AHRS_TRIM|FORMAT_VERSION|SYSID_SW|[A-Z]+_TOTAL)"
    r"|^(BRD_|CAN_|NET_|RELAY|SERIAL\d|SERVO\d+_FUNCTION|BATT\d?_(VOLT_MULT|AMP_PERVLT|AMP_OFFSET|MONITOR)|EK3_IMU_MASK)"
    r"|^(CAL_|LND_FLIGHT|COM_FLIGHT_UUID|SYS_AUTOCONFIG)"
)

T = TypeVar("T")

Numbers = list[str | float | bool | None]
"""Unit, least, most, default, whether it needs a restart."""
Row = tuple[Numbers, str, str]
"""With its choices and its bits, as the lists of facts.ts; empty where it has none."""
NOTHING: Final[Numbers] = ["", None, None, None, False]


def number(text: Any) -> float | None:
    """A finite number to the digits of a float32, or None."""
    try:
        value = float(text)
    except (TypeError, ValueError):
        return None
    if abs(value) > 1e12 or math.isnan(value):
        return None
    return int(value) if value.is_integer() else float(f"{value:.7g}")


def listed(pairs: Iterator[tuple[Any, str]], *, identifiers: bool = False) -> str:
    known = {number(value): label(words, identifier=identifiers) for value, words in pairs}
    return ", ".join(f"{value} {words}" for value, words in sorted(known.items(), key=lambda one: one[0] or 0) if words)


def bounds(least: Any, most: Any) -> tuple[float | None, float | None]:
    low, high = number(least), number(most)
    return (low, high) if low is None or high is None or low < high else (None, None)


def of_ardupilot(fields: dict[str, Any]) -> Row:
    span = fields.get("Range", {})
    low, high = bounds(span.get("low"), span.get("high"))
    unit = fields.get("Units", "")
    restarts = str(fields.get("RebootRequired", "")).lower() == "true"
    values, bits = fields.get("Values", {}), fields.get("Bitmask", {})
    return (
        [UNITS.get(unit, unit), low, high, None, restarts],
        listed(iter(values.items())),
        listed(iter(bits.items()), identifiers=True),
    )


def of_component(fields: dict[str, Any]) -> Row:
    low, high = bounds(fields.get("min"), fields.get("max"))
    unit = fields.get("units", "")
    default = None if OF_ONE_MACHINE.search(fields["name"]) else number(fields.get("default"))
    values = listed((one["value"], one["description"]) for one in fields.get("values", []))
    bits = listed((one["index"], one["description"]) for one in fields.get("bitmask", []))
    return [UNITS.get(unit, unit), low, high, default, bool(fields.get("rebootRequired", False))], values, bits


def told(path: Path) -> dict[str, Row]:
    content = json.loads(path.read_text())
    if "parameters" in content:
        # What is written in small letters is of other nodes on its CAN bus.
        return {one["name"]: of_component(one) for one in content["parameters"] if not one["name"][0].islower()}
    groups = (group for group in content.values() if isinstance(group, dict))
    return {name: of_ardupilot(one) for group in groups for name, one in group.items() if isinstance(one, dict)}


def defaults_of(path: Path) -> dict[str, float | None]:
    text = path.read_text()
    if text.lstrip().startswith("{"):
        table = json.loads(text)
        return {name: row[3] for name, row in table.get("numbers", table).items()}
    lines = (line.partition("#")[0].strip().partition(",") for line in text.splitlines())
    return {name.strip(): number(value) for name, _, value in lines if value}


def patterns(name: str) -> Iterator[str]:
    for digits in re.finditer(r"\d+", name):
        yield f"{name[: digits.start()]}#{name[digits.end() :]}"


def gathered(table: dict[str, T]) -> dict[str, T]:
    """Those that differ by one number in their name only, and in nothing else, as one."""
    members: dict[str, list[str]] = {}
    for name in table:
        for pattern in patterns(name):
            members.setdefault(pattern, []).append(name)
    kept = dict(table)
    for pattern, names in members.items():
        rows = [kept.get(name) for name in names]
        if len(names) > 2 and None not in rows and all(row == rows[0] for row in rows):
            kept[pattern] = table[names[0]]
            for name in names:
                del kept[name]
    return kept


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--defaults", type=Path)
    parser.add_argument("files", type=Path, nargs="+")
    options = parser.parse_args()
    table: dict[str, Row] = {}
    for path in options.files:
        table.update(told(path))
    defaults = defaults_of(options.defaults) if options.defaults else {}
    numbers: dict[str, Numbers] = {}
    for name, (row, _, _) in table.items():
        known = [defaults[one] for one in (name, *patterns(name)) if defaults.get(one) is not None]
        if row[3] is None and known and not OF_ONE_MACHINE.search(name):
            row[3] = known[0]
        if row != NOTHING:
            numbers[name] = row
    lists: dict[str, int] = {}

    def named(texts: dict[str, str]) -> dict[str, int]:
        return {name: lists.setdefault(text, len(lists)) for name, text in sorted(gathered(texts).items())}

    choices = named({name: values for name, (_, values, _) in table.items() if values})
    bits = named({name: mask for name, (_, _, mask) in table.items() if mask})
    parts = [
        *(
            f"  {json.dumps(key)}: {{\n{rows_of(part)}\n  }}"
            for key, part in (
                ("numbers", dict(sorted(gathered(numbers).items()))),
                ("choices", choices),
                ("bits", bits),
            )
        ),
        '  "lists": [\n' + ",\n".join(f"    {json.dumps(one, ensure_ascii=False)}" for one in lists) + "\n  ]",
    ]
    sys.stdout.write("{\n" + ",\n".join(parts) + "\n}\n")


def rows_of(part: Mapping[str, object]) -> str:
    return ",\n".join(f"    {json.dumps(name)}: {json.dumps(row, ensure_ascii=False)}" for name, row in part.items())


if __name__ == "__main__":
    main()
