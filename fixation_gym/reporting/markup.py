"""HTML by hand: a few elements, the style sheet and the frame of the page. Text is escaped where it enters."""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence
from string import Template

STYLE = """
:root { color-scheme: light dark; --ground: #ffffff; --text: #1d2329; --soft: #5c6670; --line: #d9dee3;
  --card: #f6f8fa; --link: #0b62a4; --best: #0a7d3c; }
@media (prefers-color-scheme: dark) { :root { --ground: #14171a; --text: #e3e7ea; --soft: #98a2ab; --line: #333a41;
  --card: #1c2126; --link: #6cb4ee; --best: #58c98b; }
  img.plot { filter: invert(0.91) hue-rotate(180deg); } }
body { font: 15px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, sans-serif; color: var(--text);
  background: var(--ground); max-width: 72rem; margin: 0 auto; padding: 1.5rem 1.2rem 4rem; }
h1 { font-size: 1.7rem; margin: 0.5rem 0; } h2 { font-size: 1.25rem; margin: 2.6rem 0 0.6rem; }
h3 { font-size: 1.02rem; margin: 1.6rem 0 0.4rem; } p { margin: 0.5rem 0; max-width: 52rem; } a { color: var(--link); }
.note, figcaption, small { color: var(--soft); font-size: 0.87rem; }
nav a { margin-right: 1rem; white-space: nowrap; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; margin: 0.2rem 0 1.2rem; font-variant-numeric: tabular-nums; }
th, td { padding: 0.32rem 0.7rem; border-bottom: 1px solid var(--line); text-align: left; vertical-align: top; }
thead th { border-bottom: 2px solid var(--line); font-weight: 600; }
tbody th { font-weight: 600; white-space: nowrap; }
td small { white-space: nowrap; }
figure { margin: 0.8rem 0; } figure img { max-width: 100%; height: auto; border-radius: 4px; display: block; }
code, pre { font: 0.86rem/1.45 ui-monospace, SFMono-Regular, Menlo, Consolas, monospace; }
pre { background: var(--card); padding: 0.7rem 0.9rem; border-radius: 4px; overflow-x: auto; }
article { background: var(--card); border: 1px solid var(--line); border-radius: 6px; padding: 0.4rem 1rem;
  margin: 1rem 0; }
article h4 { margin: 0.4rem 0; font-size: 1rem; font-weight: 600; }
.kind { border: 1px solid var(--line); border-radius: 9px; padding: 0 0.5rem; margin-left: 0.5rem;
  font-size: 0.85rem; font-weight: 400; }
summary { cursor: pointer; color: var(--link); } .hash { word-break: break-all; }
"""

_PAGE = Template(
    """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>$style</style>
</head>
<body>
$body
</body>
</html>
"""
)


class Html(str):
    """Text that is HTML already."""

    __slots__ = ()


def page(title: str, body: Sequence[Html]) -> str:
    """A whole document."""
    return _PAGE.substitute(title=html.escape(title), style=STYLE, body="\n".join(body))


def escaped(text: str) -> Html:
    """Text as HTML; what is HTML already stays as it is."""
    return text if isinstance(text, Html) else Html(html.escape(text))


def joined(parts: Sequence[str], between: str = "\n") -> Html:
    """Parts one after the other, each escaped if it is not HTML."""
    return Html(between.join(map(escaped, parts)))


def element(tag: str, content: str, kind: str = "", anchor: str = "") -> Html:
    """``<tag class=kind id=anchor>content</tag>``."""
    attributes = (f' class="{kind}"' if kind else "") + (f' id="{anchor}"' if anchor else "")
    return Html(f"<{tag}{attributes}>{escaped(content)}</{tag}>")


def table(head: Sequence[str], rows: Sequence[Sequence[str]], caption: str) -> Html:
    """A table whose first column names the rows, below a line of text."""
    top = "".join(element("th", cell) for cell in head)
    body = "\n".join(
        f"<tr>{element('th', row[0])}{''.join(element('td', cell) for cell in row[1:])}</tr>" for row in rows
    )
    return Html(
        f'{element("p", caption, "note")}\n<div class="wide"><table>\n<thead><tr>{top}</tr></thead>\n'
        f"<tbody>\n{body}\n</tbody></table></div>"
    )


def image(data: bytes, kind: str, description: str, plot: bool = True) -> Html:
    """An image inside the page; ``kind`` is "png" or "jpeg". Plots are inverted on dark screens, photographs not."""
    encoded = base64.b64encode(data).decode("ascii")
    style = ' class="plot"' if plot else ""
    return Html(f'<img{style} alt="{html.escape(description)}" src="data:image/{kind};base64,{encoded}">')


def figure(picture: Html, caption: str) -> Html:
    """A picture with a line below it, if there is one to say."""
    line = element("figcaption", caption) if caption else ""
    return Html(f"<figure>{picture}{line}</figure>")


def details(summary: str, content: Html) -> Html:
    """Content that opens on a click."""
    return Html(f"<details>{element('summary', summary)}\n{content}</details>")
