"""Make the table of plain numbers about ArduCopter's parameters: units, ranges, defaults, which need a restart.

    python scripts/build_parameter_numbers.py apm.pdef.xml default.param [other.param ...] \
        > src/parameters/facts/arducopter_numbers.json

The first file is what ArduPilot publishes about its parameters (apm.pdef.xml of a release), the second a list of
NAME,VALUE as a vehicle of that release has it before anybody changed it; other lists add names that are met on real
vehicles, not their values. Sentences are taken from none of them: ours are in src/parameters/facts/arducopter.ts.

Calibrations, identities, counters, and what hangs on the kind of board have no default. What is the same for every
number in a name stands once, with `#` for the number.
"""

import json
import re
import sys
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

UNITS: Final = {"d%": "%/10", "ds": "s/10", "octal": "", "degC": "°C", "cdegC": "c°C", "PWM": "us", "%": "%"}
"""Those that we write in another way."""
OF_ONE_MACHINE: Final = re.compile(
    r"_(ID\d?|DEV_ID\d?|DEVID|OFFS_[XYZ]|SCAL_[XYZ]|CALTEMP|GND_PRESS|PIN\d?|CHECKSUM|SERIAL_NUM)$"
    r"|^(STAT|SIM|COMPASS_(OFS|DIA|ODI|MOT|PRIO|DEV)|INS_TCAL|AHRS_TRIM|FORMAT_VERSION|SYSID_SW|[A-Z]+_TOTAL)"
    r"|^(BRD_|CAN_|NET_|RELAY|SERIAL\d|SERVO\d+_FUNCTION|BATT\d?_(VOLT_MULT|AMP_PERVLT|AMP_OFFSET|MONITOR)|EK3_IMU_MASK)"
)

Numbers = list[str | float | bool | None]
"""Unit, least, most, default, whether it needs a restart."""


def told(xml: Path) -> dict[str, Numbers]:
    """What the published file says, of parameters that have anything of it."""
    found: dict[str, Numbers] = {}
    for one in ElementTree.parse(xml).iter("param"):  # noqa: S314 - a file that a developer chose
        name = one.attrib["name"].rpartition(":")[2]
        fields = {field.attrib["name"]: (field.text or "").strip() for field in one.iter("field")}
        bounds = re.fullmatch(r"(-?[\d.]+)[\s-]+(-?[\d.]+)", fields.get("Range", ""))
        least, most = (number(bounds[1]), number(bounds[2])) if bounds else (None, None)
        if least is not None and most is not None and least >= most:
            least = most = None
        unit = fields.get("Units", "")
        reboot = fields.get("RebootRequired", "").lower() == "true"
        found[name] = [UNITS.get(unit, unit), least, most, None, reboot]
    return found


def number(text: str) -> float:
    value = float(text)
    return int(value) if value.is_integer() else value


def values(parameters: Path) -> dict[str, str]:
    lines = (line.partition("#")[0].strip() for line in parameters.read_text().splitlines())
    return {name.strip(): value.strip() for name, _, value in (line.partition(",") for line in lines) if value}


def gathered(table: dict[str, Numbers]) -> dict[str, Numbers]:
    """Those that differ by one number in their name only, and in nothing else, as one."""
    members: dict[str, list[str]] = {}
    for name in table:
        for digits in re.finditer(r"\d+", name):
            members.setdefault(f"{name[: digits.start()]}#{name[digits.end() :]}", []).append(name)
    kept = dict(table)
    for pattern, names in members.items():
        rows = [kept.get(name) for name in names]
        if len(names) > 2 and None not in rows and all(row == rows[0] for row in rows):
            kept[pattern] = table[names[0]]
            for name in names:
                del kept[name]
    return kept


def main() -> None:
    xml, *lists = map(Path, sys.argv[1:])
    defaults = values(lists[0])
    met = set().union(*map(values, lists))
    table = {name: row for name, row in told(xml).items() if name in met}
    for name, value in defaults.items():
        if not OF_ONE_MACHINE.search(name):
            table.setdefault(name, ["", None, None, None, False])[3] = number(value)
    told_of = {name: row for name, row in table.items() if row != ["", None, None, None, False]}
    rows = (
        f"  {json.dumps(name)}: {json.dumps(row, ensure_ascii=False)}"
        for name, row in sorted(gathered(told_of).items())
    )
    sys.stdout.write("{\n" + ",\n".join(rows) + "\n}\n")


if __name__ == "__main__":
    main()
