"""Tables for notebooks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import cast


def page(heading: str, *parts: str) -> str:
    """A heading and what is below it."""
    return f"<div><p><b>{escape(heading)}</b></p>{''.join(parts)}</div>"


def paragraph(text: str) -> str:
    """A paragraph."""
    return f"<p>{escape(text)}</p>"


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table; its first column is text."""
    cells = "".join(f'<th style="text-align:left">{escape(name)}</th>' for name in head)
    body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in rows)
    return f"<table><thead><tr>{cells}</tr></thead><tbody>{body}</tbody></table>"


def _cell(value: object) -> str:
    return f'<td style="text-align:left">{escape(number(value))}</td>'


def number(value: object) -> str:
    """A value in few characters."""
    match value:
        case None:
            return ""
        case bool():
            return "yes" if value else ""
        case float():
            return f"{value:.6g}"
        case tuple() | list():
            return ", ".join(map(number, cast("Sequence[object]", value)))
        case _:
            return str(value)
