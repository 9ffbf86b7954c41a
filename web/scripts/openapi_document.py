"""Prints the tower's OpenAPI document as JSON with sorted keys. Starts no server and opens no database.

`generate_rest_types.mjs` makes the console's REST types of it. Run with the project's Python.
"""

import json
import sys

from server.app.composition import create_app
from server.runtime.settings import Settings

if __name__ == "__main__":
    json.dump(create_app(Settings()).openapi(), sys.stdout, sort_keys=True)
