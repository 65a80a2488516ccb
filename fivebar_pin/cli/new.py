"""`fivebar-pin new`: a linkage file to start from."""

from __future__ import annotations

import argparse
import shlex
import sys


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the parser."""
    parser = commands.add_parser(
        "new",
        help="write a linkage file to start from",
        description="Write a commented linkage file (YAML), which every command takes as a mechanism.",
    )
    parser.add_argument("kind", help="four-bar, five-bar, six-bar or slider-crank")
    parser.add_argument("--out", default=".", metavar="PATH", help="folder, or file.yaml (default: here)")
    parser.add_argument("--overwrite", action="store_true", help="replace a file of that name")
    parser.set_defaults(run=run)


def run(chosen: argparse.Namespace) -> int:
    """Write the file and say what to do with it."""
    from fivebar_pin._files import as_path, write_set
    from fivebar_pin.planar.starts import start_text

    text = start_text(chosen.kind)
    folder, name = as_path(chosen.out), f"{chosen.kind.replace('-', '_')}.yaml"
    if folder.suffix.lower() in (".yaml", ".yml") and not folder.is_dir():
        folder, name = folder.parent, folder.name
    (path,) = write_set(folder, {name: text}, overwrite=chosen.overwrite)
    shown = shlex.quote(str(path))
    lines = [
        f"{path} written. Edit it, then:",
        f"  fivebar-pin check {shown}       what it can do, and whether it is sound",
        f"  fivebar-pin view {shown}        look at it in the browser",
        f"  fivebar-pin loads {shown}       what its motors and its frame carry",
        f"  fivebar-pin balance {shown}     the optimal balanced design",
    ]
    sys.stdout.write("\n".join([*lines, ""]))
    return 0
