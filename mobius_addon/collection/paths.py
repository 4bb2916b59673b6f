"""The paths that a topology was carried along, drawn as a tree from left to right."""

from __future__ import annotations

from html import escape

from ...solver.collection import Collection

PICTURED = 60
"""Specimens up to which each has its picture; more are dots."""

NAMED = 400
"""Specimens up to which dots have names."""

SIDE, COLUMN, ROW = 64, 128, 92
"""Pixels of a picture, and from one to the next."""

DOT_COLUMN, DOT_ROW = 62, 20
"""The same of dots."""

LETTERS, DOT_LETTERS = 17, 10
"""Letters of a name that fit under a picture, and over a dot that lines go on from."""


def short(name: str, most: int) -> str:
    """Return a name of at most so many letters: of a longer one its beginning and its end.

    >>> short("AMNH-M-76882_M786", 9)
    'AMNH…M786'
    """
    if len(name) <= most:
        return name
    end = (most - 1) // 2
    return f"{name[: most - 1 - end]}…{name[len(name) - end :]}"


def places(routes: dict[int, list[int]], root: int) -> dict[int, tuple[int, float]]:
    """Return the column and the row of each specimen: ends in rows of their own, the others midway between theirs."""
    children: dict[int, list[int]] = {}
    for path in routes.values():
        if len(path) > 1:
            children.setdefault(path[-2], []).append(path[-1])
    found: dict[int, tuple[int, float]] = {}
    rows = 0
    # from the ends back, without recursion: a path may be as long as there are specimens
    walk, order = [root], []
    while walk:
        order.append(walk.pop())
        walk += sorted(children.get(order[-1], ()), reverse=True)
    for number in order:
        if number not in children:
            found[number] = len(routes[number]) - 1, float(rows)
            rows += 1
    for number in reversed(order):
        if number in children:
            below = [found[child][1] for child in children[number]]
            found[number] = len(routes[number]) - 1, (min(below) + max(below)) / 2
    return found


def draw_paths(collection: Collection, pictures: dict[str, str], bad: set[tuple[int, int]]) -> str:
    """Draw the tree that the paths from the root are; `bad` pairs are red."""
    found = places(collection.routes, collection.root)
    pictured = len(found) <= PICTURED
    column, row, side = (COLUMN, ROW, SIDE) if pictured else (DOT_COLUMN, DOT_ROW, 8)
    at = {number: (column * (x + 0.5), row * (y + 0.5)) for number, (x, y) in found.items()}
    inner = {path[-2] for path in collection.routes.values() if len(path) > 1}
    lines, nodes = [], []
    for number, (x, y) in at.items():
        path, name = collection.routes[number], escape(collection.names[number])
        if len(path) > 1:
            before = path[-2]
            left, up = at[before][0] + side / 2, at[before][1]
            middle = (left + x - side / 2) / 2
            color = "#b3261e" if (min(before, number), max(before, number)) in bad else "#9aa0a6"
            lines.append(
                f'<path d="M{left:.0f} {up:.1f}C{middle:.0f} {up:.1f} {middle:.0f} {y:.1f} {x - side / 2:.0f} {y:.1f}" '
                f'fill="none" stroke="{color}" stroke-width="2"/>'
            )
        weight = ' font-weight="bold"' if number == collection.root else ""
        picture = pictures.get(collection.names[number]) if pictured else None
        if picture is None:
            nodes.append(f'<circle cx="{x:.0f}" cy="{y:.1f}" r="4" fill="#3b6ea5"><title>{name}</title></circle>')
        else:
            corner = f'x="{x - side / 2:.0f}" y="{y - side / 2:.1f}" width="{side}" height="{side}"'
            nodes.append(f'<image href="{picture}" {corner}><title>{name}</title></image>')
        if pictured:
            text = f'x="{x:.0f}" y="{y + side / 2 + 11:.1f}" font-size="11" text-anchor="middle"'
            nodes.append(f"<text {text}{weight}>{escape(short(collection.names[number], LETTERS))}</text>")
        elif len(found) <= NAMED and number in inner and number != collection.root:
            text = f'x="{x:.0f}" y="{y - 6:.1f}" font-size="8" text-anchor="middle" fill="#555"'
            nodes.append(f"<text {text}>{escape(short(collection.names[number], DOT_LETTERS))}</text>")
        elif len(found) <= NAMED:
            anchor = 'text-anchor="end"' if number == collection.root else ""
            x += -8 if anchor else 8
            nodes.append(f'<text x="{x:.0f}" y="{y + 4:.1f}" font-size="11" {anchor}{weight}>{name}</text>')
    depth, rows = max(x for x, _ in found.values()), max(y for _, y in found.values())
    longest = 0 if pictured else 7 * max(len(collection.names[number]) for number in found)
    before = 0 if pictured else 7 * len(collection.names[collection.root])
    width, height = column * (depth + 1) + longest, row * (rows + 1)
    return (
        f'<div class="wide"><svg xmlns="http://www.w3.org/2000/svg" viewBox="{-before} 0 {width + before:.0f} '
        f'{height:.0f}" width="{width + before:.0f}" height="{height:.0f}" '
        f'font-family="system-ui, sans-serif">{"".join(lines)}{"".join(nodes)}</svg></div>'
    )
