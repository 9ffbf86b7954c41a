"""Draws the PNG icons of the installed console from web/public/icon.svg, with Debian's Chromium. Run it after a change:

    .venv/bin/python web/scripts/make_icons.py

`any` icons keep the rounded corners of the drawing; `maskable` ones fill the square, with the drawing inside the circle
that every system leaves (four fifths of the side), and so does Apple's, which rounds the corners by itself.
"""

import shutil
from pathlib import Path

from playwright.sync_api import sync_playwright

PUBLIC = Path(__file__).resolve().parent.parent / "public"
GROUND = "#0d1620"
"""Of the drawing itself."""
ICONS = {
    "icon-192.png": (192, 1.0, "transparent"),
    "icon-512.png": (512, 1.0, "transparent"),
    "icon-maskable-192.png": (192, 0.8, GROUND),
    "icon-maskable-512.png": (512, 0.8, GROUND),
    "apple-touch-icon.png": (180, 0.9, GROUND),
}
"""Name: side in pixels, how much of it the drawing takes, what is behind it."""


def main() -> None:
    drawing = (PUBLIC / "icon.svg").read_text(encoding="utf-8")
    path = shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        for name, (side, share, ground) in ICONS.items():
            page = browser.new_page(viewport={"width": side, "height": side})
            page.set_content(
                f"<body style='margin:0;display:grid;place-items:center;height:100vh;background:{ground}'>"
                f"<div style='width:{share:.0%};line-height:0'>{drawing}</div>"
            )
            page.screenshot(path=PUBLIC / name, omit_background=True)
            page.close()
        browser.close()


if __name__ == "__main__":
    main()
