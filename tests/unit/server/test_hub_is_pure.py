"""The hub owns live state and knows no database and no web framework: importing it loads neither."""

import subprocess
import sys


def test_importing_the_hub_loads_no_database_and_no_web_framework() -> None:
    script = "import sys, server.live.hub; print(sorted({'sqlalchemy', 'fastapi', 'starlette'} & sys.modules.keys()))"
    loaded = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert loaded.stdout.strip() == "[]"
