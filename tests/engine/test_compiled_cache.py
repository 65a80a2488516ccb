"""Machine code is kept for as long as the sources stay that it was made from."""

from pathlib import Path

import numba
import pytest

from fivebar_pin.engine import compiled


@pytest.fixture
def home(tmp_path, monkeypatch):
    """Return a folder of kernels, with a place for machine code."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "cache"))
    folder = tmp_path / "kernels"
    folder.mkdir()
    (folder / "kernel.py").write_text("x = 1\n")
    return folder


def test_a_change_beside_the_function_asks_for_another_place(home):
    """Numba looks at the file of the function alone; the functions that it calls may stand beside it."""
    before = compiled._cache(home)
    assert before == compiled._cache(home)
    (home / "beside.py").write_text("y = 1\n")
    after = compiled._cache(home)
    assert after != before
    (home / "beside.py").write_text("y = 2\n")
    assert compiled._cache(home) not in (before, after)


def test_functions_of_the_engine_depend_on_the_engine_alone(home):
    engine = Path(compiled.__file__).resolve().parent
    before = compiled._cache(engine)
    (home / "kernel.py").write_text("x = 2\n")
    assert compiled._cache(engine) == before
    assert compiled._cache(home) != before
