"""Random smooth drives that keep clear of singularities, and whether a library that promises to follow them does.

    python tests/drives.py 2000 [seed]          # prints false alarms and silent flips of every shipped mechanism
    python tests/drives.py 500 [seed] tight     # the same with drives that only just keep clear
    python tests/drives.py 500 [seed] blocked   # motions that leave the reach: which go through all the same

A drive is judged by its own straight lines: the actuated coordinates are refined between the samples by linear
interpolation, and the refined motion has to go through, its passive Jacobian clearly regular at every one of some
10 000 points and no point further from the last than the complements of both say. The coarse motion then has to go
through as well (anything else is a false alarm) and to arrive at the same configurations (anything else is a flip).
Where the refined motion is blocked, the coarse one has to be refused too.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import islice

import numpy as np

import fivebar_pin as fb
from fivebar_pin._arrays import Array
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.loops import Loops, loops_of

CLEAR = 0.02
"""Smallest scaled singular value of the passive columns on a way that is clear of singularities [-]."""
REFINED = 10_000
"""Points of the reference, at least."""
SAME = 1e-9
"""Difference of two configurations that are one [rad, or chain lengths]."""
LEAD = 200
"""Points on the straight line from the named configuration to the first sample."""
_STRAYED = 0.3
"""Distance from what the complements predict, as part of the singular value: another mode is about twice that away."""
_FEWEST, _MOST = 20, 400
"""Samples of a drive."""
_SMALLEST, _LARGEST = 0.05, 3.0
"""Sum of the amplitudes of one motor's harmonics [rad, or chain lengths]."""
_HARMONICS = 4
"""Harmonics of one motor, at most."""
_TURNING = 0.25
"""Share of the drives that also turn their motors round."""
_WIDER, _WIDENED, _HALVED = 1.6, 5, 4
"""A drive that is to be tight: how much wider it is tried next, how often, and how often halfway back."""
_IN_VAIN = 100
"""Motions not kept in a row after which there is thought to be none to keep."""
_BLOCKED = ("AssemblyError", "SingularityError")
"""What is said of a motion that cannot be followed."""
_BLOCK = 2048
"""Configurations worked on at a time."""


@dataclass(frozen=True)
class Drive:
    """A motion that can be driven, and where it leads.

    Attributes:
        motion: of the actuated coordinates.
        q: configurations at the samples (n, nq), from the refined motion.
        clearance: smallest scaled singular value on the way [-].
    """

    motion: fb.Motion
    q: Array
    clearance: float


@dataclass
class Tally:
    """What became of drives that can be driven.

    Attributes:
        drives: how many there were.
        alarms: errors that were raised though the way is clear: number of the drive and the error.
        flips: numbers of the drives that silently ended up on another way.
    """

    drives: int = 0
    alarms: list[tuple[int, fb.FiveBarPinError]] = field(default_factory=list)
    flips: list[int] = field(default_factory=list)


def random_drives(
    chain: fb.ClosedChain,
    rng: np.random.Generator,
    *,
    clear: float = CLEAR,
    tight: bool = False,
    refused: Counter[str] | None = None,
) -> Iterator[Drive]:
    """Yield drives of a chain without end; its motions start on the assembly mode of its first named configuration.

    Args:
        chain: the mechanism.
        rng: source of the motions.
        clear: smallest singular value allowed on the way [-].
        tight: whether each motion is made as wide as it may be.
        refused: where to count why motions were not kept.
    """
    home, in_vain = next(iter(chain.references.values())), 0
    while in_vain < _IN_VAIN:
        found = reference(chain, home, random_motion(chain, home, rng), clear)
        if isinstance(found, Drive):
            in_vain = 0
            yield _widened(chain, home, found, clear) if tight else found
        else:
            in_vain += 1
            if refused is not None:
                refused[found] += 1
    raise RuntimeError(f"{chain.name}: none of {_IN_VAIN} motions keeps {clear:g} away from singularities")


def _widened(chain: fb.ClosedChain, home: Array, drive: Drive, clear: float) -> Drive:
    """Return the same motion about the named configuration, as wide as it is clear, at most ten times as wide."""
    centre = loops_of(chain).actuated_of(home[None])
    base, width, step = drive.motion, 1.0, _WIDER
    for _ in range(_WIDENED):
        found = reference(chain, home, _scaled(base, centre, width * step), clear)
        if not isinstance(found, Drive):
            break
        drive, width = found, width * step
    else:
        return drive
    for _ in range(_HALVED):
        step = np.sqrt(step)
        found = reference(chain, home, _scaled(base, centre, width * step), clear)
        if isinstance(found, Drive):
            drive, width = found, width * step
    return drive


def _scaled(motion: fb.Motion, centre: Array, width: float) -> fb.Motion:
    return fb.Motion(motion.t, centre + width * (motion.q - centre), width * motion.v, width * motion.a)


def judge(chain: fb.ClosedChain, drives: Sequence[Drive]) -> Tally:
    """Drive the coarse motions and compare where they lead with the references."""
    tally = Tally(len(drives))
    for k, drive in enumerate(drives):
        try:
            q = fb.drive(chain, drive.motion, near=drive.q[0], limits="ignore").q
        except fb.FiveBarPinError as error:
            tally.alarms.append((k, error))
            continue
        if apart(loops_of(chain), q, drive.q) > SAME:
            tally.flips.append(k)
    return tally


def blocked_motions(chain: fb.ClosedChain, rng: np.random.Generator) -> Iterator[tuple[fb.Motion, Array]]:
    """Yield motions whose straight lines leave the reach or meet a singularity, and where they start (nq,)."""
    home, in_vain = next(iter(chain.references.values())), 0
    while in_vain < _IN_VAIN:
        motion = random_motion(chain, home, rng)
        in_vain += 1
        if reference(chain, home, motion, 0.0) in _BLOCKED:
            try:
                start = _followed(chain, home, lines(chain, home, motion)[0][: LEAD + 1]).q[-1]
            except fb.FiveBarPinError:  # on the way to the first sample already
                continue
            in_vain = 0
            yield motion, start


def passed(chain: fb.ClosedChain, blocked: Sequence[tuple[fb.Motion, Array]]) -> list[int]:
    """Return which blocked motions go through when their samples alone are given."""
    through = []
    for k, (motion, start) in enumerate(blocked):
        with suppress(fb.FiveBarPinError):
            fb.drive(chain, motion, near=start, limits="ignore")
            through.append(k)
    return through


def random_motion(chain: fb.ClosedChain, home: Array, rng: np.random.Generator) -> fb.Motion:
    """Return harmonics of random amplitude and phase about the named configuration, a second long."""
    loops = loops_of(chain)
    t = np.linspace(0.0, 1.0, round(np.exp(rng.uniform(np.log(_FEWEST), np.log(_MOST)))))
    q, v, a = (np.zeros((t.size, chain.na)) for _ in range(3))
    q += loops.actuated_of(home[None])
    whole = np.exp(rng.uniform(np.log(_SMALLEST), np.log(_LARGEST)))
    turning = rng.random() < _TURNING
    for k in range(chain.na):
        scale = whole * rng.uniform(0.3, 1.0) * loops.column_scale[chain.actuated_index[k]]
        share = rng.dirichlet(np.ones(rng.integers(1, _HARMONICS + 1)))
        for h, part in enumerate(scale * share, start=1):
            w, x = 2.0 * np.pi * h, 2.0 * np.pi * (h * t + rng.random())
            q[:, k] += part * np.sin(x)
            v[:, k] += part * w * np.cos(x)
            a[:, k] -= part * w**2 * np.sin(x)
        if turning and loops.tree.is_angle(int(chain.actuated_index[k])):
            turns = 2.0 * np.pi * rng.integers(-2, 3)
            q[:, k] += turns * t
            v[:, k] += turns
    return fb.Motion(t, q, v, a)


def reference(chain: fb.ClosedChain, home: Array, motion: fb.Motion, clear: float) -> Drive | str:
    """Follow a motion in small steps; return why not where it cannot be."""
    loops, (X, fine) = loops_of(chain), lines(chain, home, motion)
    try:
        path = _followed(chain, home, X)
    except fb.FiveBarPinError as error:
        return type(error).__name__
    sigma = smallest_singular_value(loops, path.q[LEAD:])
    if sigma.min() < clear:
        return "too near to a singularity"
    if not _is_one_way(loops, path.q[LEAD:], path.N[LEAD:], X[LEAD:], sigma):
        return "too coarse to be sure"
    return Drive(motion, np.array(path.q[LEAD::fine]), float(sigma.min()))  # a view would keep all of it


def _followed(chain: fb.ClosedChain, home: Array, X: Array) -> fb.Trajectory:
    """Follow actuated coordinates (n, na), one after the other."""
    still = np.zeros_like(X)
    return fb.drive(chain, fb.Motion(np.arange(len(X), dtype=float), X, still, still), near=home, limits="ignore")


def lines(chain: fb.ClosedChain, home: Array, motion: fb.Motion) -> tuple[Array, int]:
    """Return points on the straight lines to the first sample and from there on, and how many a sample takes."""
    fine = -(-REFINED // (len(motion) - 1))
    lead = np.linspace(loops_of(chain).actuated_of(home[None])[0], motion.q[0], LEAD, endpoint=False)
    return np.concatenate([lead, _refined(motion.q, fine)]), fine


def _refined(x: Array, fine: int) -> Array:
    """Return samples (n, na) with fine - 1 points on the straight line between any two ((n - 1) fine + 1, na)."""
    at = np.arange((len(x) - 1) * fine + 1) / fine
    columns = np.column_stack([np.interp(at, np.arange(len(x)), x[:, k]) for k in range(x.shape[1])])
    columns[::fine] = x
    return columns


def smallest_singular_value(loops: Loops, q: Array) -> Array:
    """Return the smallest scaled singular value of the passive columns (n,)."""
    blocks = [Configurations(loops, q[k : k + _BLOCK]).passive.sigma for k in range(0, len(q), _BLOCK)]
    return np.concatenate(blocks)


def _is_one_way(loops: Loops, q: Array, N: Array, X: Array, sigma: Array) -> bool:
    """Tell whether every step is the one that the complements of its ends predict, nearer than any other mode."""
    step = loops.tree.difference(q[:-1], q[1:])
    predicted = np.einsum("nva,na->nv", 0.5 * (N[:-1] + N[1:]), np.diff(X, axis=0))
    strayed = np.abs((step - predicted) / loops.column_scale).max(axis=1)
    return bool(np.all(strayed < _STRAYED * np.minimum(sigma[:-1], sigma[1:])))


def apart(loops: Loops, q0: Array, q1: Array) -> float:
    """Return the largest difference of two ways (n, nq), whole turns of angles left out [rad, or chain lengths]."""
    d = loops.tree.difference(q0, q1) / loops.column_scale
    angles = np.array([loops.tree.is_angle(k) for k in range(loops.tree.nv)])
    d[:, angles] -= 2.0 * np.pi * np.round(d[:, angles] / (2.0 * np.pi))
    return float(np.abs(d).max(initial=0.0))


def main(count: str, seed: str = "0", kind: str = "") -> None:
    """Drive the shipped mechanisms at random and say what went wrong."""
    names = fb.io.shipped()
    each, total = -(-int(count) // len(names)), Counter[str]()
    for k, name in enumerate(names):
        chain, rng, start = (
            fb.load(fb.io.shipped_path(name)),
            np.random.default_rng([int(seed), k]),
            time.perf_counter(),
        )
        found = _blocked(chain, rng, each) if kind == "blocked" else _driven(chain, rng, each, kind == "tight")
        sys.stdout.write(f"{name}, {time.perf_counter() - start:.1f} s: {_listed(found)}\n")
        total.update(found)
    sys.stdout.write(f"together: {_listed(total)}\n")


def _driven(chain: fb.ClosedChain, rng: np.random.Generator, each: int, tight: bool) -> Counter[str]:
    refused = Counter[str]()
    drives = list(islice(random_drives(chain, rng, tight=tight, refused=refused), each))
    tally = judge(chain, drives)
    for k, what in [*tally.alarms, *((k, "flipped") for k in tally.flips)]:
        sys.stdout.write(f"    drive {k}, {len(drives[k].q)} samples, clearance {drives[k].clearance:.3f}: {what}\n")
    counts = {"drives": tally.drives, "false alarms": len(tally.alarms), "flips": len(tally.flips)}
    return Counter({**counts, **{f"not kept: {why}": n for why, n in refused.items()}})


def _blocked(chain: fb.ClosedChain, rng: np.random.Generator, each: int) -> Counter[str]:
    blocked = list(islice(blocked_motions(chain, rng), each))
    return Counter({"blocked": len(blocked), "went through": len(passed(chain, blocked))})


def _listed(found: Counter[str]) -> str:
    return ", ".join(f"{n} {what}" for what, n in found.items())


if __name__ == "__main__":
    main(*sys.argv[1:])
