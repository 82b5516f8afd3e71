# SPDX-License-Identifier: GPL-2.0-or-later
"""Drawings that try to run or load something in a page that shows them, each with a harmless path.

`{trap}` is an address that must not be requested.  Code that runs sets `window.ran`.
"""

from __future__ import annotations

ROOT = (
    '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
    'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" viewBox="0 0 100 100"{root}>'
)
GOOD = '<path id="good" d="M10,40 L50,10 L90,40 L90,90 L10,90 Z" fill="#8ac"/>'

# fmt: off
WAYS = {
    "script": "<script>window.ran = 1</script>",
    "script from elsewhere": '<script xlink:href="{trap}a.js"/>',
    "script by data": '<script href="data:text/javascript,window.ran=1"/>',
    "event of a shape": '<rect width="9" height="9" onclick="window.ran=1" onmouseover="window.ran=1"/>',
    "event at load": '<g onload="window.ran=1"><rect width="5" height="5" onload="window.ran=1"/></g>',
    "event of an image": '<image href="{trap}b.png" width="9" height="9" onerror="window.ran=1"/>',
    "link that runs": '<a href="javascript:window.ran=1"><rect id="inner" width="99" height="99"/></a>',
    "link elsewhere": '<a xlink:href="{trap}c" target="_top"><rect width="99" height="99"/></a>',
    "foreign object": (
        '<foreignObject width="99" height="99"><iframe xmlns="http://www.w3.org/1999/xhtml" src="{trap}d"/>'
        '<img xmlns="http://www.w3.org/1999/xhtml" src="x" onerror="window.ran=1"/></foreignObject>'
    ),
    "animation": (
        '<rect width="9" height="9"><animate attributeName="x" to="50" dur="1s" onbegin="window.ran=1"/>'
        '<set attributeName="onclick" to="window.ran=1"/></rect>'
    ),
    "animated link": (
        '<use id="u"><set attributeName="href" to="{trap}e.svg#a"/>'
        '<animate attributeName="xlink:href" values="data:image/svg+xml,x#a" begin="0s"/></use>'
    ),
    "clone from elsewhere": (
        '<use href="{trap}f.svg#a"/><use xlink:href="data:image/svg+xml;base64,PHN2Zy8+#a"/>'
    ),
    "image in an image": (
        '<image width="9" height="9" href="data:image/svg+xml,%3Csvg xmlns=%27http://www.w3.org/2000/svg%27%3E'
        '%3Cimage href=%27{trap}g.png%27/%3E%3Cscript%3Etop.ran=1%3C/script%3E%3C/svg%3E"/>'
    ),
    "sheet from elsewhere": (
        '<style>@import url({trap}h.css); @import "{trap}i.css"; #good {{ fill: red }}</style>'
    ),
    "font from elsewhere": (
        "<style>@font-face {{ font-family: f; src: url({trap}j.woff2) }} text {{ font-family: f }}</style>"
        '<text y="20">a</text>'
    ),
    "paint from elsewhere": (
        '<rect width="9" height="9" fill="url({trap}k.svg#p)" style="filter:url(\'{trap}l.svg#f\');'
        "mask:url( {trap}m.svg#m );cursor:url({trap}n.cur),auto;background:url({trap}o.png)\"/>"
    ),
    "hidden by escapes": (
        '<rect width="9" height="9" style="fill:\\75rl({trap}p.svg#p);background:u\\72l({trap}q.png)"/>'
        "<style>#good {{ mask: \\75 rl({trap}r.svg#m); font-family: \\75 }}"
        " @\\69mport url({trap}s.css);</style>"
    ),
    "hidden by comments": (
        "<style>#good {{ mask: ur/**/l({trap}t.svg#m); list-style: /* x */ url({trap}u.png) }} "
        "/* */ @import/**/'{trap}v.css';</style>"
    ),
    "sheets beside the drawing": (
        '<link xmlns="http://www.w3.org/1999/xhtml" rel="stylesheet" href="{trap}w.css"/>'
        '<style>:host {{ display: none }} #stage, header {{ display: none !important }}</style>'
        '<base xmlns="http://www.w3.org/1999/xhtml" href="{trap}"/>'
    ),
    "filter from elsewhere": (
        '<filter id="f"><feImage href="{trap}x.png"/><feImage xlink:href="{trap}y.svg#a"/></filter>'
        '<rect width="9" height="9" filter="url(#f)"/><handler xmlns:ev="http://www.w3.org/2001/xml-events" '
        'type="text/javascript" ev:event="load">window.ran=1</handler>'
    ),
    "events of the root": (
        '<metadata><x xmlns="http://www.w3.org/1999/xhtml" onload="window.ran=1"/></metadata>'
    ),
}
# fmt: on

ROOT_MORE = {"events of the root": ' onload="window.ran=1" onfocusin="window.ran=1"'}

# A doctype with an entity, and a sheet named before the root.
BEFORE = {
    "sheet from elsewhere": '<?xml-stylesheet href="{trap}z.css" type="text/css"?>',
    "script from elsewhere": '<!DOCTYPE svg [<!ENTITY e SYSTEM "{trap}entity">]>',
}


def drawing(way: str, trap: str) -> bytes:
    """A hostile drawing.  trap : an address that ends with a slash"""
    root = ROOT.format(root=ROOT_MORE.get(way, ""))
    before = BEFORE.get(way, "").format(trap=trap)
    return (before + root + WAYS[way].format(trap=trap) + GOOD + "</svg>").encode()
