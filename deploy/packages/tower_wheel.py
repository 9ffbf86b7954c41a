"""Build hook of the distribution `control-tower`: puts console and migrations inside the package.

An editable installation needs neither: it finds them in the checkout (`server/runtime/packaged.py`).
"""

from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class TowerWheel(BuildHookInterface[Any]):
    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if version == "editable":
            return
        console = Path(self.root) / "web" / "dist"
        if not (console / "index.html").is_file():
            raise FileNotFoundError("the console is not built: run `make setup` first")
        build_data["force_include"] |= {"web/dist": "server/console", "migrations": "server/migrations"}
