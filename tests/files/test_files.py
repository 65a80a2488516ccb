"""Files are read within bounds, and written all or none: at whatever moment the writer ends, and whatever fails."""

from __future__ import annotations

import errno
import os
import signal
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from kills import WRITERS, campaign, fork

import fivebar_pin as fb
from fivebar_pin._files import check_folder, check_new, read_bounded, write_file, write_set, writing
from fivebar_pin._files.exchange import exchange
from fivebar_pin._files.staging import Staging
from fivebar_pin.errors import FileFormatError, InvalidInputError, OutputError

OLD = {"a.txt": "old a", "b.txt": "old b", "c.bin": b"old c"}
NEW = {"a.txt": "new a", "b.txt": "new b", "d.txt": "new d"}
KILLS = int(os.environ.get("KILLS", "12"))
CAN_EXCHANGE = sys.platform in ("linux", "darwin")

needs_exchange = pytest.mark.skipif(not CAN_EXCHANGE, reason="no call that lets two folders trade places")


def held(folder: Path) -> dict[str, str]:
    """Return what somebody finds who lists the folder and reads its files; folders by a slash."""
    there = [p for p in folder.iterdir() if not p.name.startswith(".fivebar_pin-")]
    return {p.name: "/" if p.is_dir() else p.read_text() for p in there}


def hidden(place: Path) -> list[str]:
    return [str(p) for p in place.rglob(".*") if p.name.startswith(".fivebar_pin-")]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with an older set, and a file of the user's."""
    write_set(tmp_path / "out", OLD, overwrite=False)
    (tmp_path / "out" / "mine.txt").write_text("mine")
    return tmp_path / "out"


BEFORE = {"a.txt": "old a", "b.txt": "old b", "c.bin": "old c", "mine.txt": "mine"}
AFTER = {"a.txt": "new a", "b.txt": "new b", "c.bin": "old c", "d.txt": "new d", "mine.txt": "mine"}


def ended_at(step: int, work: Callable[[], object]) -> bool:
    """Do the work in a child that ends without a word before its step-th call about files; whether it came so far."""
    child = fork()
    if child == 0:
        seen = 0

        def hook(event: str, _: object) -> None:
            nonlocal seen
            if event.startswith(("os.", "shutil.", "tempfile.", "open", "fcntl.")):
                seen += 1
                if seen > step:
                    os._exit(9)

        sys.addaudithook(hook)
        try:
            work()
        finally:
            os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 9


@needs_exchange
def test_a_set_is_old_or_new_at_whatever_step_its_writer_ends(folder: Path) -> None:
    """The process ends before each of its calls in turn; nothing is mixed or lost, and the next writer clears up."""
    found = []
    for step in range(1000):
        if not ended_at(step, lambda: write_set(folder, NEW, overwrite=True)):
            break
        found.append(held(folder))
        assert found[-1] in (BEFORE, AFTER), step
        write_set(folder, OLD, overwrite=True)
        (folder / "d.txt").unlink(missing_ok=True)
        assert held(folder) == BEFORE and not hidden(folder.parent), step
    assert step > 30 and BEFORE in found and AFTER in found


def test_where_folders_cannot_trade_places_the_next_writer_completes_the_set(folder: Path) -> None:
    """A folder that holds folders: no file is half-written or lost at any step, and what was begun is finished."""
    (folder / "sub").mkdir()
    (folder / "sub" / "deep.txt").write_text("deep")
    mixed = 0
    for step in range(1000):
        if not ended_at(step, lambda: write_set(folder, NEW, overwrite=True)):
            break
        now = held(folder)
        assert all(now[name] in (text, AFTER[name]) for name, text in BEFORE.items()), step
        mixed += now not in (BEFORE | {"sub": "/"}, AFTER | {"sub": "/"})
        write_file(folder / "other.txt", "x", overwrite=True)
        del now, (rest := held(folder))["other.txt"]
        assert rest in (BEFORE | {"sub": "/"}, AFTER | {"sub": "/"}), step
        (folder / "other.txt").unlink()
        assert not hidden(folder.parent) and (folder / "sub" / "deep.txt").read_text() == "deep"
        write_set(folder, OLD, overwrite=True)
        (folder / "d.txt").unlink(missing_ok=True)
    assert step > 30 and mixed <= 2 * len(NEW)


def test_kills_at_random_moments_leave_all_files_of_one_job(tmp_path: Path) -> None:
    """Each kill -9 hits a writer that replaces one mechanism by another as fast as it can."""
    found = campaign(WRITERS["save"], KILLS, 7, tmp_path)
    assert found == {"whole": KILLS, "strays left": 0}


@needs_exchange
def test_two_writers_at_once_leave_the_set_of_one(folder: Path) -> None:
    """Each waits for the other; nothing strays and nothing of the user's goes."""
    texts = [{f"{k}.txt": f"{job}" for k in range(5)} for job in "AB"]
    for text in texts:
        write_set(folder, text, overwrite=True)

    def write(files: dict[str, str]) -> None:
        for _ in range(30):
            write_set(folder, files, overwrite=True)

    writers = [threading.Thread(target=write, args=(text,)) for text in texts]
    for thread in writers:
        thread.start()
    for thread in writers:
        thread.join(60.0)
    assert len(set(held(folder)[f"{k}.txt"] for k in range(5))) == 1
    assert held(folder)["mine.txt"] == "mine" and not hidden(folder.parent)


@needs_exchange
def test_the_folder_stays_itself(folder: Path, tmp_path: Path) -> None:
    """Its number, its rights, a link to it and a process that stands in it."""
    (tmp_path / "link").symlink_to(folder)
    os.chmod(folder, 0o750)
    number, rights = folder.stat().st_ino, folder.stat().st_mode
    mine = (folder / "mine.txt").stat().st_ino
    here = os.open(folder, os.O_RDONLY)
    write_set(tmp_path / "link", NEW, overwrite=True)
    assert (tmp_path / "link").is_symlink() and held(folder) == AFTER
    assert (folder.stat().st_ino, folder.stat().st_mode) == (number, rights)
    assert sorted(os.listdir(here)) == sorted(AFTER)
    os.close(here)
    assert (folder / "mine.txt").stat().st_ino == mine and (folder / "mine.txt").stat().st_nlink == 1


@needs_exchange
def test_names_trade_places_in_one_step_or_not_at_all(tmp_path: Path) -> None:
    for name in "ab":
        (tmp_path / name).mkdir()
        (tmp_path / name / name).touch()
    assert exchange(tmp_path / "a", tmp_path / "b")
    assert [p.name for p in (tmp_path / "a").iterdir()] == ["b"]
    assert not exchange(tmp_path / "a", tmp_path / "none") and (tmp_path / "a").exists()


@needs_exchange
def test_what_somebody_put_into_a_folder_that_was_being_replaced_comes_home(folder: Path) -> None:
    """The writer ends between the two exchanges, after another program has opened the folder and made a file in it."""
    stage = Staging.holding({name: text.encode() for name, text in NEW.items()}, folder.parent, folder)
    for name in ("mine.txt", "c.bin"):
        os.link(folder / name, stage.new / name)
    assert exchange(folder, stage.new)
    (stage.new / "late.txt").write_text("late")
    write_file(folder / "other.txt", "x", overwrite=False)
    assert held(folder) == AFTER | {"late.txt": "late", "other.txt": "x"} and not hidden(folder.parent)


FULL = OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.parametrize("inside", [False, True], ids=["exchanged", "moved"])
@pytest.mark.parametrize("call", ["fsync", "mkdir", "replace", "link"])
def test_what_fails_leaves_what_was_there(
    folder: Path, monkeypatch: pytest.MonkeyPatch, call: str, inside: bool
) -> None:
    """A full disk at any call: the older set stays whole, one line says why, nothing strays."""
    if inside:
        (folder / "sub").mkdir()
    before = held(folder)
    for nth in range(8):
        calls, real = 0, getattr(os, call)

        def fail(*args: object, nth: int = nth, real: Callable[..., object] = real, **words: object) -> object:
            nonlocal calls
            calls += 1
            if calls == nth + 1:
                raise FULL
            return real(*args, **words)

        with monkeypatch.context() as patch:
            patch.setattr(os, call, fail)
            try:
                write_set(folder, NEW, overwrite=True)
            except OutputError as error:
                assert "No space left" in str(error) and "\n" not in str(error)
                assert held(folder) == before
            else:
                assert held(folder) == {**AFTER, **({"sub": "/"} if inside else {})}
        assert not hidden(folder.parent)
        write_set(folder, OLD, overwrite=True)
        (folder / "d.txt").unlink(missing_ok=True)


def test_an_interrupt_between_two_renamings_completes_the_set(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "sub").mkdir()
    calls, real = 0, os.replace

    def interrupted(*args: object) -> None:
        nonlocal calls
        calls += 1
        if calls == 2:
            raise KeyboardInterrupt
        real(*args)  # type: ignore[arg-type]

    monkeypatch.setattr(os, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_set(folder, NEW, overwrite=True)
    assert held(folder) == AFTER | {"sub": "/"} and not hidden(folder.parent)


def test_what_exists_is_kept_and_what_is_no_file_is_never_replaced(folder: Path, tmp_path: Path) -> None:
    """Neither a device, nor a pipe, nor a folder, whatever the caller allows."""
    with pytest.raises(OutputError, match="exists already; pass overwrite=True"):
        write_set(folder, NEW, overwrite=False)
    assert held(folder) == BEFORE
    os.mkfifo(folder / "d.txt")
    with pytest.raises(OutputError, match=r"d\.txt: cannot be written: it is a pipe or a device"):
        write_set(folder, NEW, overwrite=True)
    (tmp_path / "null").symlink_to(os.devnull)
    with pytest.raises(OutputError, match="pipe or a device"):
        write_file(tmp_path / "null", "x", overwrite=True)
    with pytest.raises(OutputError, match="cannot be written: it is a folder"):
        write_file(folder, "x", overwrite=True)
    assert (folder / "a.txt").read_text() == "old a" and not hidden(tmp_path)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("n" * 300, "File name too long"),
        ("file/deeper", "Not a directory|it is a file"),
        ("file/deeper/still", "Not a directory"),
        ("x\0y", "must be the name of a file"),
        ("", "must be the name of a file"),
        ("half \ud800", "half a character"),
        (7, "must be the name of a file"),
    ],
)
def test_names_that_no_file_can_have_are_refused(tmp_path: Path, name: object, message: str) -> None:
    (tmp_path / "file").write_text("")
    path = os.path.join(tmp_path, name) if isinstance(name, str) and name else name
    for call in (
        lambda: write_file(path, "x", overwrite=True),
        lambda: write_set(path, OLD, overwrite=True),
        lambda: check_folder(path, overwrite=True),
    ):
        with pytest.raises((OutputError, InvalidInputError), match=message):
            call()
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def test_folders_that_cannot_be_written_are_refused_before_the_work(tmp_path: Path) -> None:
    """A file in the way, a system folder, a folder that holds something."""
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot be written into: it is a file"):
        check_folder(tmp_path / "file", overwrite=True)
    with pytest.raises(OutputError, match="cannot be written"):
        check_folder("/proc/nowhere/deeper", overwrite=True)
    with pytest.raises(OutputError, match=r"is not empty \(holds file\)"):
        check_folder(tmp_path, overwrite=False)
    assert check_folder(tmp_path / "a" / "b", overwrite=False) == tmp_path / "a" / "b"
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="nothing is forbidden to the superuser")
def test_a_folder_without_permission_is_refused(tmp_path: Path) -> None:
    (tmp_path / "shut").mkdir(mode=0o500)
    with pytest.raises(OutputError, match="Permission denied"):
        write_set(tmp_path / "shut", OLD, overwrite=True)


def test_a_protected_folder_is_not_exchanged_away(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever may rename a folder but not write into it may not replace what it holds."""
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != folder)
    assert not writing._can_exchange(folder, {})
    monkeypatch.setattr(os, "access", lambda path, mode: True)
    assert writing._can_exchange(folder, {})


def test_text_with_half_a_character_is_refused_with_its_file(folder: Path) -> None:
    with pytest.raises(InvalidInputError, match=r"text of b\.txt .*half a character"):
        write_set(folder, {"a.txt": "x", "b.txt": "caf\ud800"}, overwrite=True)
    assert held(folder) == BEFORE


def test_a_failed_write_leaves_no_folder_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_: int) -> None:
        raise FULL

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OutputError, match="No space left"):
        write_set(tmp_path / "a" / "b", OLD, overwrite=False)
    assert list(tmp_path.iterdir()) == []


def test_pipes_and_devices_are_refused_and_never_waited_for(tmp_path: Path) -> None:
    """A pipe nobody writes to, endless and system files; through every reader of a user's file."""
    pipe = tmp_path / "pipe.csv"
    os.mkfifo(pipe)
    for read in (read_bounded, fb.motion.from_file):
        for path in (pipe, Path("/dev/zero"), Path("/dev/tty"), tmp_path):
            with pytest.raises(FileFormatError, match="cannot be read"):
                read(path)
    for path in (tmp_path / ("n" * 300), tmp_path / "none.csv", Path("/proc/self/mem")):
        with pytest.raises(FileFormatError, match="cannot be read"):
            read_bounded(path)


def test_no_read_waits_for_a_file_that_only_seems_to_be_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Some files of the system do; here a pipe that takes the place of a file after it was looked at."""

    def late(*_: object) -> None:
        raise AssertionError("waits")

    os.mkfifo(tmp_path / "pipe.csv")
    monkeypatch.setattr(Path, "is_file", lambda _: True)
    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(10)
    try:
        with pytest.raises(FileFormatError, match="is empty"):
            read_bounded(tmp_path / "pipe.csv")
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def test_new_files_need_their_folder_and_a_free_name(tmp_path: Path) -> None:
    (tmp_path / "there").write_text("")
    with pytest.raises(OutputError, match="exists already"):
        check_new(tmp_path / "there", overwrite=False)
    with pytest.raises(OutputError, match="folder does not exist"):
        check_new(tmp_path / "none" / "x", overwrite=False)
    assert check_new(tmp_path / "there", overwrite=True) == tmp_path / "there"


def test_every_writer_goes_through_one_door() -> None:
    """No other module opens, saves or renames a file of the user's by itself."""
    root = Path(fb.__file__).parent
    words = (".write_text(", ".write_bytes(", "os.replace(", "os.rename(", '.open("w', "mkdir(")
    for file in root.rglob("*.py"):
        if file.parent.name != "_files":
            text = file.read_text()
            assert not [word for word in words if word in text], file
            for word in ("savefig(", "savetxt("):
                assert text.count(word) == text.count(f"{word}content") + text.count(f"{word}text"), file
