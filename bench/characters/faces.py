"""Which typefaces train the reader of characters, which set its thresholds, and which only judge it.

The split was made before the first figure. A family is in one list alone. Designs have relatives all the same: STIX is
of Times' kind, as Nimbus Roman is, and Carlito of Lato's. Debian has all of them; `PACKAGES` says where. What is not
installed is left out, and the figures say which were there.
"""

from __future__ import annotations

import subprocess
from dataclasses import dataclass
from typing import Final

PACKAGES: Final = (
    "fonts-liberation fonts-roboto-unhinted fonts-lato fonts-cantarell fonts-freefont-ttf fonts-urw-base35 "
    "fonts-texgyre fonts-hack fonts-inconsolata fonts-dosis fonts-cabin fonts-quicksand fonts-oxygen fonts-play "
    "fonts-b612 fonts-roadgeek fonts-opendin fonts-osifont fonts-routed-gothic fonts-allerta fonts-cmu fonts-vollkorn "
    "fonts-quattrocento fonts-karla fonts-jura fonts-comfortaa fonts-tuffy fonts-junction fonts-bebas-neue "
    "fonts-national-park fonts-adf-gillius fonts-adf-universalis fonts-adf-switzera fonts-ebgaramond "
    "fonts-linuxlibertine fonts-crosextra-carlito fonts-crosextra-caladea fonts-lmodern fonts-courier-prime "
    "fonts-jetbrains-mono fonts-firacode fonts-manrope fonts-averia-sans-gwf fonts-paratype fonts-league-spartan "
    "fonts-clear-sans fonts-tiresias fonts-ocr-b fonts-beteckna fonts-eurofurence fonts-mplus fonts-adf-baskervald "
    "fonts-open-sans fonts-inter fonts-go fonts-sora fonts-roboto-slab fonts-stix fonts-fantasque-sans "
    "fonts-gfs-neohellenic fonts-dejavu"
)

TRAINING: Final = [
    "Allerta", "Averia Sans GWF", "Baskervald ADF Std", "Bebas Neue", "Beteckna", "CMU Bright", "CMU Concrete",
    "CMU Sans Serif", "CMU Serif", "CMU Typewriter Text", "Cabin", "Comfortaa", "Courier Prime",
    "Courier Prime Sans", "Dosis", "EB Garamond", "Fira Code", "FreeMono", "FreeSans", "FreeSerif", "Gillius ADF",
    "Gillius ADF No2", "Hack", "Inconsolata", "JetBrains Mono", "Junction", "Jura", "Latin Modern Roman",
    "Latin Modern Sans", "Lato", "Liberation Mono", "Liberation Sans", "Liberation Sans Narrow", "Liberation Serif",
    "Linux Biolinum O", "Linux Libertine O", "M PLUS 1", "M PLUS 2", "M PLUS Code Latin 50", "Manrope",
    "National Park", "Nimbus Mono PS", "Nimbus Roman", "Nimbus Sans", "Nimbus Sans Narrow", "OCR B", "OSP\\-DIN",
    "OSP-DIN", "Oxygen Mono", "Oxygen-Sans", "P052", "C059", "Quattrocento", "Quicksand", "Roadgeek 2014 Series B",
    "Roadgeek 2014 Series C", "Roadgeek 2014 Series D", "Roadgeek 2014 Series E", "Roadgeek 2014 Series F",
    "Roboto", "Roboto Condensed", "Routed Gothic", "Routed Gothic Narrow", "Routed Gothic Wide", "Switzera ADF",
    "TeX Gyre Adventor", "TeX Gyre Bonum", "TeX Gyre Cursor", "TeX Gyre Heros", "TeX Gyre Heros Cn",
    "TeX Gyre Pagella", "TeX Gyre Schola", "TeX Gyre Termes", "Tiresias Infofont", "Tiresias LPfont",
    "Tiresias PCfont", "Tiresias Signfont", "Tuffy", "URW Bookman", "URW Gothic", "Universalis ADF Std", "Vollkorn",
    "eurofurence", "eurofurence classic", "osifont",
]  # fmt: skip

CHECKING: Final = [
    "Karla", "Play", "PT Sans", "PT Sans Caption", "PT Sans Narrow", "PT Serif", "PT Mono", "Cantarell",
    "League Spartan", "B612", "B612 Mono", "Carlito", "Caladea", "Clear Sans",
]  # fmt: skip

JUDGING: Final = [
    "DejaVu Sans", "DejaVu Sans Mono", "DejaVu Serif", "Open Sans", "Open Sans Condensed", "Inter", "Inter Display",
    "Go", "Go Medium", "Go Mono", "Sora", "Roboto Slab", "STIX", "Fantasque Sans Mono", "GFS Neohellenic",
]  # fmt: skip

_SLANTED: Final = ("italic", "oblique", "slanted", "thin", "hairline", "extralight", "ultralight", "smallcaps", "caps")


@dataclass(frozen=True, slots=True)
class Face:
    """`index`: in a collection of several."""

    family: str
    path: str
    index: int


def installed(families: list[str]) -> list[Face]:
    """Returns the upright faces of these families that this machine has, in the same order everywhere."""
    form = "%{family[0]}\t%{style[0]}\t%{file}\t%{index}\t%{variable}\n"
    listed = subprocess.run(["fc-list", "-f", form], capture_output=True, text=True, check=True).stdout
    found = {}
    for line in listed.splitlines():
        family, style, path, index, variable = line.split("\t")
        upright = not any(word in style.lower().replace(" ", "") for word in _SLANTED)
        # The instances of a variable font have numbers that Pillow does not take.
        if family in families and upright and variable != "True" and int(index) < 0x10000:
            found[family, style] = Face(family, path, int(index))
    return [found[key] for key in sorted(found)]
