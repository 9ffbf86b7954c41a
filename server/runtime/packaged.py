"""Where the console and the migrations lie: inside the package once it is built, at the root of a checkout before."""

from pathlib import Path
from typing import Final

_SERVER: Final = Path(__file__).resolve().parents[1]
_CHECKOUT: Final = _SERVER.parent


def _packaged_or(packaged: Path, in_checkout: Path) -> Path:
    return packaged if packaged.is_dir() else in_checkout


CONSOLE: Final = _packaged_or(_SERVER / "console", _CHECKOUT / "web" / "dist")
MIGRATIONS: Final = _packaged_or(_SERVER / "migrations", _CHECKOUT / "migrations")
