"""`fivebar-pin pareto`: the front between two objectives."""

from __future__ import annotations

import argparse

from fivebar_pin._arrays import figures, integer
from fivebar_pin._files import check_new, write_file
from fivebar_pin.cli import _output, _tables
from fivebar_pin.cli._designing import add_common, add_designing, options_of
from fivebar_pin.cli._load import load_any
from fivebar_pin.cli._moving import motion_along

_MOST_POINTS = 10_000  # designs on a front; each is a problem to solve


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the parser."""
    pareto = commands.add_parser("pareto", help="the front between two objectives of balanced designs")
    add_common(pareto)
    add_designing(pareto)
    pareto.add_argument("first", help="term that is bounded step by step")
    pareto.add_argument("second", help="term that is minimised under each bound")
    pareto.add_argument("--points", type=int, default=11, help="designs on the front [11]")
    pareto.add_argument("--out", metavar="CSV", help="write the front as a table")
    pareto.set_defaults(run=run)


def run(chosen: argparse.Namespace) -> int:
    """Trace the front, print and write it."""
    from fivebar_pin.balancing import pareto

    integer("--points", chosen.points, least=2, most=_MOST_POINTS)
    out = check_new(chosen.out, overwrite=False) if chosen.out is not None else None
    chain = load_any(chosen)
    options = options_of(chosen, chain, motion_along(chain, chosen.motion))
    console = _tables.console()
    with _tables.progress().status("tracing the front"):
        front = pareto(chain, chosen.kind, chosen.first, chosen.second, chosen.points, **options)
    if out is not None:
        columns = [(chosen.first, front.values[:, 0]), (chosen.second, front.values[:, 1])]
        write_file(out, _output.columns_text(columns), overwrite=False)
    pair = (chosen.first, chosen.second)
    rows = [[figures(d.terms[name], d.scale(name), digits=6) for name in pair] for d in front.designs]
    _tables.table(console, f"{chain.name}: {chosen.kind} balance", (chosen.first, chosen.second), rows)
    _tables.written(console, () if out is None else (out,))
    return 0
