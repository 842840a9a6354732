#!/usr/bin/python3
"""usage: make_probing_picture.py > docs/probing.svg

What each probing routine touches, from above: part, place of the tip before, touches in their order.
"""

SIZE, GAP, TOP = 150, 18, 26
PART, INK, TOUCH = "#d9dee4", "#30363d", "#c0392b"


def part(x, y, w, h):
    return f'<rect x="{x}" y="{y}" width="{w}" height="{h}" fill="{PART}" stroke="{INK}"/>'


def disc(x, y, r, fill):
    return f'<circle cx="{x}" cy="{y}" r="{r}" fill="{fill}" stroke="{INK}"/>'


def touches(*ways, first=1):
    """Arrows from (x, y) to (x, y), numbered."""
    out = []
    for number, (x0, y0, x1, y1) in enumerate(ways, first):
        out.append(f'<line x1="{x0}" y1="{y0}" x2="{x1}" y2="{y1}" stroke="{TOUCH}" stroke-width="2" '
                   'marker-end="url(#tip)"/>')
        out.append(f'<text x="{(x0 + x1) / 2 + 5}" y="{(y0 + y1) / 2 - 5}" fill="{TOUCH}">{number}</text>')
    return "".join(out)


def start(x, y):
    return f'<circle cx="{x}" cy="{y}" r="5" fill="none" stroke="{INK}" stroke-width="2"/>'


PANELS = (
    ("edge", part(80, 20, 60, 110) + start(25, 75) + touches((33, 75, 72, 75))),
    ("corner", part(60, 20, 80, 70) + start(25, 125)
     + touches((25, 75, 52, 75), (25, 40, 52, 40), (80, 125, 80, 98), (122, 125, 122, 98))),
    ("angle", f'<g transform="rotate(-8 75 50)">{part(15, 15, 120, 50)}</g>' + start(40, 125)
     + touches((40, 117, 40, 79), (115, 117, 115, 68))),
    ("bore", part(10, 10, 130, 130) + disc(75, 75, 48, "#ffffff") + start(75, 75)
     + touches((82, 75, 115, 75), (68, 75, 35, 75), (75, 68, 75, 35), (75, 82, 75, 115))),
    ("boss", disc(75, 75, 30, PART) + start(75, 75)
     + touches((140, 75, 113, 75), (10, 75, 37, 75), (75, 10, 75, 37), (75, 140, 75, 113))),
    ("web", part(55, 10, 40, 130) + start(75, 75) + touches((140, 75, 103, 75), (10, 75, 47, 75))),
    ("pocket", part(10, 10, 130, 130) + f'<rect x="35" y="30" width="80" height="90" fill="#ffffff" stroke="{INK}"/>'
     + start(75, 75) + touches((82, 75, 107, 75), (68, 75, 43, 75), (75, 68, 75, 38), (75, 82, 75, 112))),
    ("ball, along the tool", disc(75, 75, 42, PART) + disc(75, 75, 26, "none") + start(75, 75)
     + f'<text x="82" y="73" fill="{TOUCH}">1</text>'
     + touches((140, 75, 110, 75), (75, 10, 75, 40), (10, 75, 40, 75), (75, 140, 75, 110), first=2)),
)


def main():
    columns = 4
    rows = (len(PANELS) + columns - 1) // columns
    width, height = columns * (SIZE + GAP) + GAP, rows * (SIZE + GAP + TOP) + GAP
    print(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
          'font-family="sans-serif" font-size="12">')
    print('<defs><marker id="tip" markerWidth="5" markerHeight="5" refX="4" refY="2.5" orient="auto">'
          f'<path d="M0,0 L5,2.5 L0,5 z" fill="{TOUCH}"/></marker></defs>')
    print(f'<rect width="{width}" height="{height}" fill="#ffffff"/>')
    for i, (name, drawing) in enumerate(PANELS):
        x, y = GAP + i % columns * (SIZE + GAP), GAP + i // columns * (SIZE + GAP + TOP)
        print(f'<g transform="translate({x},{y})"><text x="0" y="14" font-size="14" fill="{INK}">{name}</text>'
              f'<g transform="translate(0,{TOP - 6})">{drawing}</g></g>')
    print("</svg>")


main()
