"""Build hook of the distribution `control-tower-connect`: `tower connect` alone, with the wire and the agent's small
copy of the MAVLink dialect.

An editable installation needs none of them: it finds all in the checkout.
"""

import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "agent"))

from small_dialect import licence, small_dialect

CHECKOUT = Path(__file__).resolve().parents[3]


class ConnectWheel(BuildHookInterface[Any]):
    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if version == "editable":
            return
        made = Path(tempfile.mkdtemp(prefix="tower-connect-wheel-"))
        (made / "small_ardupilotmega.py").write_text(small_dialect(), encoding="utf-8")
        (made / "LICENSE.pymavlink").write_text(licence(), encoding="utf-8")
        build_data["force_include"] |= {
            str(CHECKOUT / "connect"): "connect",
            str(CHECKOUT / "wire"): "wire",
            str(made / "small_ardupilotmega.py"): "wire/small_ardupilotmega.py",
            str(made / "LICENSE.pymavlink"): "wire/LICENSE.pymavlink",
        }
