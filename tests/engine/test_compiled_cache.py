"""Machine code is kept for as long as the sources stay that it was made from."""

from pathlib import Path

import pytest

import fivebar_pin.engine
from fivebar_pin._files.kept_code import kept_code

ENGINE = Path(fivebar_pin.engine.__file__).resolve().parent


@pytest.fixture
def home(tmp_path, monkeypatch):
    """Return a folder of kernels, with a place for machine code."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    folder = tmp_path / "kernels"
    folder.mkdir()
    (folder / "kernel.py").write_text("x = 1\n")
    return folder


def test_a_change_beside_the_function_asks_for_another_place(home):
    """Numba looks at the file of the function alone; the functions that it calls may stand beside it."""
    before = kept_code((ENGINE, home))
    assert before == kept_code((ENGINE, home))
    (home / "beside.py").write_text("y = 1\n")
    after = kept_code((ENGINE, home))
    assert after != before
    (home / "beside.py").write_text("y = 2\n")
    assert kept_code((ENGINE, home)) not in (before, after)


def test_functions_of_the_engine_depend_on_the_engine_alone(home):
    before = kept_code((ENGINE,))
    (home / "kernel.py").write_text("x = 2\n")
    assert kept_code((ENGINE,)) == before
    assert kept_code((ENGINE, home)) != before


def test_code_is_kept_nowhere_where_nothing_can_be_written(monkeypatch, tmp_path):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file" / "cache"))
    assert kept_code((ENGINE,)) is None


def test_code_is_kept_in_the_users_cache_where_the_sources_cannot_be_written_beside(monkeypatch, tmp_path):
    sources = tmp_path / "sources"
    sources.mkdir()
    (sources / "__pycache__").write_text("in the way")
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert kept_code((sources,)).parent == tmp_path / "cache" / "fivebar_pin"
