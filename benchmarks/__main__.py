"""Run the benchmarks and print their tables."""

from __future__ import annotations

import argparse

from rich.console import Console
from rich.table import Table

from benchmarks import foreign, ladder, mechanisms, roads, robot, scoring, sweeping
from benchmarks.machine import machine

PARTS = ("roads", "foreign", "mechanisms", "robot", "ladder", "assemblies", "scoring", "sweeping")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--samples", type=int, nargs="+", default=[1, 100, 1000, 100000])
    parser.add_argument("--which", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--assemblies", type=int, default=10000, help="random assemblies in all [10000]")
    parser.add_argument("--designs", type=int, default=1_000_000, help="mass distributions to score [1000000]")
    parser.add_argument("--lengths", type=int, default=100_000, help="designs of other lengths to sweep [100000]")
    chosen = parser.parse_args()
    console = Console(width=150)
    console.print(machine())
    if "roads" in chosen.which:
        rows = roads.rows(tuple(chosen.samples))
        _show(console, "Five-bar, torque and shaking wrench, per sample", roads.HEADINGS, rows)
    if "foreign" in chosen.which:
        rows, missing = foreign.rows()
        _show(console, "Five-bar in other engines, torque of both motors, per sample", foreign.HEADINGS, rows)
        console.print(*missing, sep="\n")
    if "mechanisms" in chosen.which:
        _show(console, "Shipped mechanisms, torque and shaking wrench", mechanisms.HEADINGS, mechanisms.rows())
    if "robot" in chosen.which:
        _show(console, "Four legs, 40 joints, 24 motors, 8 loops", robot.HEADINGS, robot.rows())
    if "ladder" in chosen.which:
        rows, powers = ladder.rows()
        _show(console, "N four-bars, torque and shaking wrench, per sample", ladder.HEADINGS, rows)
        own, own_hand, one, one_hand = (f"N^{power:.2f}" for power in powers)
        console.print(f"cost grows as {own} with own cranks (by hand {own_hand}), as {one} with one ({one_hand})")
    if "assemblies" in chosen.which:
        rows = mechanisms.assemblies(chosen.assemblies)
        _show(console, "Random assemblies", mechanisms.ASSEMBLIES, rows)
    if "scoring" in chosen.which:
        title = "Five-bar designs, RMS of shaking force, shaking moment and torques over 201 samples"
        _show(console, title, scoring.HEADINGS, scoring.rows(chosen.designs))
        _show(console, "Force balance of the five-bar solved again", scoring.SOLVES, scoring.solves())
    if "sweeping" in chosen.which:
        title = f"Five-bars of other lengths, {sweeping.SAMPLES} samples, torque and shaking wrench"
        _show(console, title, sweeping.HEADINGS, sweeping.rows(chosen.lengths))


def _show(console: Console, title: str, headings: tuple[str, ...], rows: list[tuple[str, ...]]) -> None:
    table = Table(title=title)
    for k, heading in enumerate(headings):
        table.add_column(heading, justify="right" if k else "left")
    for row in rows:
        table.add_row(*row)
    console.print(table)


if __name__ == "__main__":
    main()
