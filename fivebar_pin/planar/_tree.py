"""Which joints of a linkage make its tree, and which are cut.

Links are nodes; pins and slides are edges. A minimal spanning tree from the ground takes driven joints first, then
slides, then pins near the ground: so every motor and, where loops allow, every slide is a joint of the tree, and what
is cut is a pin as a rule, which a point closure states.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from fivebar_pin.errors import InvalidInputError
from fivebar_pin.planar._parts import GROUND, Link, Motor

__all__ = ["Cut", "Edge", "SpanningTree", "block_of", "spanning_tree"]

_DRIVEN, _SLIDE, _PIN = 0, 1, 2


@dataclass(frozen=True, slots=True)
class Edge:
    """A joint of the tree: `child` hangs on `parent` at a point, or on a slide (`at` is empty)."""

    parent: str
    child: str
    at: str


@dataclass(frozen=True, slots=True)
class Cut:
    """A joint that is cut: links `first` and `second` meet at a point, or slide on each other (`at` is empty)."""

    first: str
    second: str
    at: str


@dataclass(frozen=True, slots=True)
class SpanningTree:
    """Joints in the order of the tree, every branch to its end first, and what is cut.

    Where a slide is cut, a massless block runs on its line, a joint of the tree, and is to be welded to the link.
    """

    edges: tuple[Edge, ...]
    cuts: tuple[Cut, ...]


def spanning_tree(name: str, links: Mapping[str, Link], motors: Iterable[Motor]) -> SpanningTree:
    """Choose the tree.

    Args:
        name: of the linkage, for messages.
        links: by name, the ground among them.
        motors: with the point and the other link of each filled in.

    Raises:
        InvalidInputError: a link that hangs on nothing, or motors that drive every joint of a loop.
    """
    motors = tuple(motors)
    users = {p: [x.name for x in links.values() if p in x.points] for x in links.values() for p in x.points}
    neighbours: dict[str, list[tuple[int, str, str]]] = {name: [] for name in links}

    def join(kind: int, one: str, other: str, at: str) -> None:
        driven = any((m.link, m.on, m.at) in ((one, other, at), (other, one, at)) for m in motors)
        for a, b in ((one, other), (other, one)):
            neighbours[a].append((_DRIVEN if driven else kind, b, at))

    for link in links.values():
        if link.guide is not None:
            join(_SLIDE, link.guide.on, link.name, "")
    for point, sharing in users.items():
        for k, one in enumerate(sharing):
            for other in sharing[k + 1 :]:
                join(_PIN, one, other, point)
    edges = _grown(neighbours)
    _check_reached(name, links, {GROUND, *(e.child for e in edges)})
    for m in motors:
        if not any({e.parent, e.child} == {m.link, m.on} and e.at == m.at for e in edges):
            where = f"{m.link} at {m.at}" if m.at else m.link
            raise InvalidInputError(
                f"motor of {where}", where, "closes a loop of motors: a loop needs joints that are not driven"
            )
    cuts = tuple(_cuts(links, users, edges))
    blocks = [Edge(cut.first, block_of(cut.second), "") for cut in cuts if not cut.at]
    return SpanningTree(tuple(_depth_first([*edges, *blocks])), cuts)


def block_of(link: str) -> str:
    """Return the name of the massless block that runs on the line of a link whose slide is cut."""
    return f"{link}_block"


def _grown(neighbours: Mapping[str, list[tuple[int, str, str]]]) -> list[Edge]:
    """Return the edges of a minimal spanning tree; among equals those near the ground, then in the order said."""
    depth, edges = {GROUND: 0}, list[Edge]()
    while True:
        open_edges = [
            (kind, depth[a], k, Edge(a, b, at))
            for k, a in enumerate(depth)
            for kind, b, at in neighbours[a]
            if b not in depth
        ]
        if not open_edges:
            return edges
        edge = min(open_edges, key=lambda item: item[:3])[3]
        depth[edge.child] = depth[edge.parent] + 1
        edges.append(edge)


def _check_reached(name: str, links: Mapping[str, Link], reached: set[str]) -> None:
    left = [link for link in links if link not in reached]
    if not left:
        return
    link = links[left[0]]
    alone = not any(p in other.points for p in link.points for other in links.values() if other is not link)
    problem = (
        "connects to nothing: none of its points belongs to another bar or to the ground"
        if alone
        else f"hangs together with {', '.join(left[1:])} only, and on nothing that leads to the ground"
    )
    raise InvalidInputError(f"bar {link.name} of {name}", link.points, problem, "Name the points it shares.")


def _depth_first(edges: list[Edge]) -> Iterable[Edge]:
    stack = [e for e in reversed(edges) if e.parent == GROUND]
    while stack:
        edge = stack.pop()
        yield edge
        stack += [e for e in reversed(edges) if e.parent == edge.child]


def _cuts(links: Mapping[str, Link], users: Mapping[str, list[str]], edges: list[Edge]) -> Iterable[Cut]:
    for link in links.values():
        if link.guide is not None:
            ends = {link.name, link.guide.on}
            if not any({e.parent, e.child} == ends and not e.at for e in edges):
                yield Cut(link.guide.on, link.name, "")
    for point, sharing in users.items():
        group = {name: name for name in sharing}
        for e in edges:
            if e.at == point:
                old = group[e.child]
                group = {x: group[e.parent] if g == old else g for x, g in group.items()}
        heads = list(dict.fromkeys(group.values()))
        for head in heads[1:]:
            yield Cut(heads[0], head, point)
