"""How the report of a flight looks, on a screen and on paper."""

from typing import Final

STYLE: Final = """
:root { color-scheme: light; }
body { max-width: 60rem; margin: 2rem auto; padding: 0 1rem; color: #14202b; background: #fff;
  font: 14px/1.45 system-ui, sans-serif; }
h1 { font-size: 1.4rem; }
h2 { margin: 1.6rem 0 .4rem; font-size: 1.05rem; break-after: avoid; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .15rem 1rem; }
dt { color: #4b5b6a; }
dd { margin: 0; }
table { width: 100%; border-collapse: collapse; font-variant-numeric: tabular-nums; }
thead { display: table-header-group; }
th, td { padding: .2rem .5rem .2rem 0; border-bottom: 1px solid #d5dde5; text-align: left; vertical-align: top;
  overflow-wrap: anywhere; }
th { color: #4b5b6a; font-size: .85em; }
tr { break-inside: avoid; }
svg { display: block; margin: 1rem 0; border: 1px solid #d5dde5; }
footer { margin-top: 2rem; color: #4b5b6a; font-size: .85em; }
@page { margin: 16mm; }
@media print { body { max-width: none; margin: 0; padding: 0; font-size: 10pt; } }
"""
