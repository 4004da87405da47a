"""Small tables for notebooks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape as escape

MOST_ROWS = 200


def grid(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """An HTML table; long ones are cut with a last line that says so."""
    rows = list(rows)
    shown = rows[:MOST_ROWS]
    cells = "".join(
        "<tr>" + "".join(f'<td style="text-align:left">{escape(str(cell))}</td>' for cell in row) + "</tr>" for row in shown
    )
    if len(rows) > len(shown):
        cells += f'<tr><td colspan="{len(head)}">and {len(rows) - len(shown)} more</td></tr>'
    titles = "".join(f'<th style="text-align:left">{escape(str(title))}</th>' for title in head)
    return f"<table><thead><tr>{titles}</tr></thead><tbody>{cells}</tbody></table>"
