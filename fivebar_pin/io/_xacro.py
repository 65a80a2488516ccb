"""Expanding xacro files with the tool of that name, which ROS and a package of its own bring."""

from __future__ import annotations

import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

from fivebar_pin._files import read_bounded
from fivebar_pin.errors import FileFormatError

__all__ = ["expanded"]

_PATIENCE = 60.0
"""How long the tool may take [s]; a robot takes it one or two."""
_AS_MODULE = (sys.executable, "-c", "import sys, xacro; sys.exit(xacro.main())")


def expanded(path: Path, max_bytes: int) -> bytes:
    """Return the text that a xacro file stands for, with the values that its arguments have unless given.

    Raises:
        FileFormatError: the tool is not installed, or refuses the file, with its last words.
    """
    read_bounded(path, max_bytes)  # a file that cannot be read is told of here
    tool = shutil.which("xacro")
    if tool is None and find_spec("xacro") is None:
        rule = "is expanded by xacro, which is not installed: `pip install xacro`, or where ROS is, "
        raise FileFormatError(path, f"{rule}`xacro {path.name} > {path.name.split('.')[0]}.urdf`")
    command = [tool] if tool is not None else _AS_MODULE
    try:
        run = subprocess.run([*command, str(path)], capture_output=True, timeout=_PATIENCE, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise FileFormatError(path, f"xacro cannot expand it ({error})") from error
    if run.returncode != 0:
        said = " ".join(run.stderr.decode("utf-8", "replace").split())
        raise FileFormatError(path, f"xacro cannot expand it ({said})")
    if len(run.stdout) > max_bytes:
        raise FileFormatError(
            path, f"expands to more than {max_bytes} bytes; pass a larger max_bytes if this is intended"
        )
    return run.stdout
