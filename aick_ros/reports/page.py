# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Parts of a self-contained HTML page, without other files; it is complete without scripts."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from string import Template

from aick_ros.borders.names import printable

_LONG = 60  # characters of a cell that is kept from becoming narrow; chosen

_PAGE = Template('''<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>
:root { color-scheme: light; }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 62rem; padding: 2rem 1.5rem 3rem; color: #1f2933;
       background: #fff; font: 16px/1.5 system-ui, -apple-system, "Segoe UI", Roboto,
       "DejaVu Sans", sans-serif; }
h1 { font-size: 1.6rem; line-height: 1.25; margin: 0; overflow-wrap: anywhere; }
h2 { font-size: 1.1rem; margin: 2.25rem 0 .6rem; padding-bottom: .3rem;
     border-bottom: 1px solid #e4e7eb; }
p { margin: .35rem 0; }
.quiet { color: #616e7c; }
.notice { margin: 1rem 0; padding: .6rem .9rem; border-left: 4px solid #d9822b;
          background: #fff6ea; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(7.3rem, 1fr));
         gap: .75rem; margin: 1.5rem 0 0; }
.tile { padding: .7rem; border: 1px solid #e4e7eb; border-radius: .4rem; }
.tile b { display: block; font-size: 1.25rem; line-height: 1.3; font-weight: 600;
          font-variant-numeric: tabular-nums; }
.tile span { color: #616e7c; font-size: .85rem; }
figure { margin: 1rem 0 0; overflow-x: auto; }
figure svg { display: block; width: 100%; min-width: 36rem; height: auto; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-size: .92rem; }
th, td { text-align: left; padding: .3rem .8rem .3rem 0; border-bottom: 1px solid #eef0f2;
         vertical-align: top; }
th { color: #616e7c; font-weight: 600; }
td:not(:first-child) { font-variant-numeric: tabular-nums; }
td { overflow-wrap: break-word; max-width: 24rem; }
td.long { min-width: 16rem; }
.sortable th { cursor: pointer; }
.sortable th[aria-sort=ascending]::after { content: " \\2191"; }
.sortable th[aria-sort=descending]::after { content: " \\2193"; }
@media (prefers-color-scheme: dark) {
  :root { color-scheme: dark; }
  body { color: #e4e7eb; background: #14181d; }
  h2, .tile, th, td { border-color: #323a44; }
  .quiet, .tile span, th { color: #9aa5b1; }
  .notice { background: #3a2c14; }
  figure { padding: .5rem; border-radius: .4rem; background: #fff; }
}
code { font: .9em ui-monospace, "DejaVu Sans Mono", monospace; }
</style>
</head>
<body>
$body
</body>
</html>
''')

_SORT_SCRIPT = '''<script>
for (const head of document.querySelectorAll('.sortable th')) {
  head.tabIndex = 0;
  const sort = () => {
    const down = head.getAttribute('aria-sort') === 'ascending' ? -1 : 1;
    const value = row => {
      const text = row.cells[head.cellIndex].textContent, number = parseFloat(text);
      return Number.isNaN(number) ? text : number;
    };
    const order = (a, b) => typeof a !== typeof b ? (typeof a === 'string' ? 1 : -1)
      : a < b ? -1 : a > b ? 1 : 0;
    const body = head.closest('table').tBodies[0];
    body.append(...[...body.rows].sort((a, b) => down * order(value(a), value(b))));
    for (const other of head.parentNode.cells) other.removeAttribute('aria-sort');
    head.setAttribute('aria-sort', down > 0 ? 'ascending' : 'descending');
  };
  head.addEventListener('click', sort);
  head.addEventListener('keydown', event => { if (event.key === 'Enter') sort(); });
}
</script>'''


def page(title: str, *parts: str, sorts_tables: bool = False) -> str:
    """
    Return a complete page.

    :param title: plain text.
    :param parts: HTML.
    :param sorts_tables: a click on the head of a column sorts a sortable table.
    """
    body = '\n'.join((*parts, _SORT_SCRIPT) if sorts_tables else parts)
    return _PAGE.substitute(title=_shown(title), body=body)


def heading(text: str, level: int = 2) -> str:
    """Return a heading."""
    return f'<h{level}>{_shown(text)}</h{level}>'


def paragraph(text: str, kind: str = '') -> str:
    """Return a paragraph; its kind is ``quiet``, ``notice`` or ''."""
    return f'<p class="{kind}">{_shown(text)}</p>' if kind else f'<p>{_shown(text)}</p>'


def tiles(facts: Iterable[tuple[str, str]]) -> str:
    """Return a row of large numbers, from pairs of label and value."""
    inner = ''.join(f'<div class="tile"><b>{_shown(value)}</b><span>{_shown(label)}</span></div>'
                    for label, value in facts)
    return f'<div class="tiles">{inner}</div>'


def table(head: Iterable[str], rows: Iterable[Iterable[str]], is_sortable: bool = False) -> str:
    """Return a table of plain text."""
    body = ''.join('<tr>' + ''.join(map(_cell, row)) + '</tr>' for row in rows)
    top = ''.join(f'<th>{_shown(cell)}</th>' for cell in head)
    kind = ' class="sortable"' if is_sortable else ''
    return (f'<div class="wide"><table{kind}><thead><tr>{top}</tr></thead>'
            f'<tbody>{body}</tbody></table></div>')


def _cell(text: str) -> str:
    kind = ' class="long"' if len(text) > _LONG else ''
    return f'<td{kind}>{_shown(text)}</td>'


def picture(svg: str) -> str:
    """Return an SVG image as wide as the page."""
    return f'<figure>{svg}</figure>'


def _shown(text: str) -> str:
    """Return text as HTML, with invisible characters and bytes that are not UTF-8 escaped."""
    return escape(printable(text))
