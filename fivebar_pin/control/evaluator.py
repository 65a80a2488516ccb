"""A mechanism prepared once and evaluated one sample at a time, results in its own buffers.

As Pinocchio's model and data are to its users: a call allocates nothing and costs some microseconds.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping
from typing import Any, NoReturn

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, seal
from fivebar_pin.chain import ClosedChain
from fivebar_pin.control.placed import FrameRoom, Pushes, frame_room, pushes_at
from fivebar_pin.control.starts import require_standing, start_of
from fivebar_pin.dynamics.wrenches import require_frames
from fivebar_pin.engine.tables import Integers
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.kinematics import FrameMotion
from fivebar_pin.mechanism.idle import at_rest
from fivebar_pin.mechanism.loops import loops_of
from fivebar_pin.mechanism.prepared import prepared_of

__all__ = ["Evaluator"]

_FLOAT = np.dtype(np.float64)


class Evaluator:
    """Kinematics and dynamics of a mechanism at one sample after the other, for control.

    It stands at a closed configuration and goes on from there: every call follows the assembly mode along the straight
    line of the actuated coordinates to the new ones, each step certified, as `drive` does between samples. Joints that
    do not count their turns (continuous ones) go the shorter way. Limits of joints are not looked at.

    All results are views of its buffers, read-only: the next call overwrites them, so copy what shall stay. What a call
    does not compute is nan: forces after `kinematics` and `jump`. After an error it stands where it stood, with the
    results of the call before. An evaluator serves one thread at a time; give each its `copy()`.

    Attributes:
        chain: the mechanism.
        q, v, a: of all joints (nq,), (nv,), (nv,).
        N: complement, v = N v_actuated (nv, na).
        residual: largest of the closures () [m or rad].
        q_actuated, v_actuated, a_actuated: of the actuated joints (na,), order of `chain.actuated`.
        torque: of the actuated joints (na,) [N m or N].
        mass_matrix, bias: M_bar (na, na) and b (na,) of M_bar a_actuated + b = torque; forces from outside are in b.
        shaking_force, shaking_moment: -dp/dt and -dH/dt about the point `about` (3,) [N, N m].
        frame_force, frame_moment: the same plus weight and forces from outside: all that the frame carries (3,).
    """

    __slots__ = (
        "N", "_I", "_W", "_engine", "_frames", "_lock", "_now", "_pushes", "_q", "_shape", "_then", "_third", "_v",
        "_x", "a", "a_actuated", "bias", "chain", "frame_force", "frame_moment", "mass_matrix", "q", "q_actuated",
        "residual", "shaking_force", "shaking_moment", "torque", "v", "v_actuated",
    )  # fmt: skip

    chain: ClosedChain
    q: Array
    v: Array
    a: Array
    N: Array
    residual: Array
    q_actuated: Array
    v_actuated: Array
    a_actuated: Array
    torque: Array
    mass_matrix: Array
    bias: Array
    shaking_force: Array
    shaking_moment: Array
    frame_force: Array
    frame_moment: Array
    _I: Integers
    _W: Array
    _engine: Any
    _shape: tuple[int]
    _lock: threading.Lock
    _frames: dict[str, FrameRoom]
    _pushes: dict[tuple[str, ...], Pushes]
    _q: Array  # q, to be written
    _x: Array  # what is asked for: coordinates of the motors, their velocities, and their accelerations or torques
    _v: Array
    _third: Array
    _now: Array  # all that changes from one sample to the next, and its copy from after the last one
    _then: Array

    def __init__(
        self, chain: ClosedChain, near: npt.ArrayLike | None = None, *, about: npt.ArrayLike = (0.0, 0.0, 0.0)
    ) -> None:
        """Prepare a mechanism; the first evaluator of a process loads the engine, the first of all compiles it.

        Args:
            chain: the mechanism, its motion determined by its actuated joints. Freedoms that move nothing else are
                held at rest (`forward_dynamics` lets them move).
            near: configuration (nq,) to start from, closed or nearly so. Without it the model's named configurations
                (`chain.references`), the neutral and random ones are tried.
            about: point (3,) that shaking and frame moment refer to [m], world.

        Raises:
            AssemblyError: nothing closes there.
            SingularityError: the actuated joints do not determine the motion there.
            InvalidInputError: wrong shapes; motion left undetermined.
        """
        from fivebar_pin.engine.single import memory_of

        chain = at_rest(chain)
        loops_of(chain).require_determined()
        point, ready = checked("about", about, (3,)), prepared_of(chain)
        self._bind(chain, *memory_of(ready.I, ready.W, point))
        self._stand(start_of(chain, near))

    def kinematics(self, q_actuated: npt.ArrayLike, v_actuated: npt.ArrayLike, a_actuated: npt.ArrayLike) -> Array:
        """Move the mechanism: q, v, a, N and the motion of all frames.

        Args:
            q_actuated, v_actuated, a_actuated: of the actuated joints (na,), order of `chain.actuated`.

        Returns:
            The configuration, `self.q`.

        Raises:
            AssemblyError, SingularityError: the way there is blocked.
            InvalidInputError: wrong shapes, what is no number, a step that would take for ever; the closures tie the
                motors to each other.
        """
        self._run(self._engine.MOVE, q_actuated, v_actuated, "a_actuated", a_actuated, None)
        return self.q

    def inverse(
        self, q_actuated: npt.ArrayLike, v_actuated: npt.ArrayLike, a_actuated: npt.ArrayLike,
        external: Mapping[str, npt.ArrayLike] | None = None,
    ) -> Array:  # fmt: skip
        """Compute what the motors need to move the mechanism so, as `inverse_dynamics`, and its equations of motion.

        Args:
            q_actuated, v_actuated, a_actuated: of the actuated joints (na,), order of `chain.actuated`.
            external: forces from outside: frame name -> wrench (6,), force [N] and moment [N m] in world axes at the
                frame's origin.

        Returns:
            The torques, `self.torque`.

        Raises:
            AssemblyError, SingularityError, InvalidInputError: see `kinematics`.
            UnknownNameError: a force on a frame that does not exist.
            SolverError: a spring whose ends meet has a force of no direction.
        """
        self._run(self._engine.INVERSE, q_actuated, v_actuated, "a_actuated", a_actuated, external)
        return self.torque

    def forward(
        self, q_actuated: npt.ArrayLike, v_actuated: npt.ArrayLike, tau: npt.ArrayLike,
        external: Mapping[str, npt.ArrayLike] | None = None,
    ) -> Array:  # fmt: skip
        """Compute how the torques of the motors move the mechanism: M_bar a_actuated = tau - b, as `forward_dynamics`.

        Everything that `inverse` computes is there afterwards too.

        Args:
            q_actuated, v_actuated: of the actuated joints (na,), order of `chain.actuated`.
            tau: torque of the actuated joints (na,) [N m or N].
            external: as for `inverse`.

        Returns:
            Accelerations of the actuated joints, `self.a_actuated`; those of all are `self.a`.

        Raises:
            AssemblyError, SingularityError, InvalidInputError: see `kinematics`; a motion without inertia.
            UnknownNameError, SolverError: see `inverse`.
        """
        self._run(self._engine.FORWARD, q_actuated, v_actuated, "tau", tau, external)
        return self.a_actuated

    def frame(self, name: str) -> FrameMotion:
        """Return pose and motion of a frame at this sample; views that the next call for this frame overwrites.

        Raises:
            UnknownNameError: there is no such frame.
        """
        room = self._frames.get(name) or self._frames.setdefault(name, frame_room(self.chain, name))
        self._enter()
        try:
            self._engine.frame(self._I, self._W, room.link, room.numbers)
        finally:
            self._lock.release()
        return room.motion

    def jump(self, q: npt.ArrayLike) -> None:
        """Stand at another closed configuration (nq,), at rest.

        Raises:
            InvalidInputError: wrong shape, or not closed.
            SingularityError: the actuated joints do not determine the motion there.
        """
        there = checked("q", q, (self.chain.nq,))
        require_standing(self.chain, there)
        self._stand(there)

    def copy(self) -> Evaluator:
        """Return another evaluator that stands where this one does; it costs some microseconds."""
        self._enter()
        try:
            return _again(self.chain, self._I, np.array(self._W))
        finally:
            self._lock.release()

    __copy__ = copy

    def __reduce__(self) -> tuple[Any, ...]:
        return _again, (self.chain, self._I, self._W)

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"{name} of an evaluator is computed, not set; jump(q) takes a configuration")

    def __repr__(self) -> str:
        return f"Evaluator({self.chain!r})"

    def _bind(self, chain: ClosedChain, I: Integers, W: Array) -> None:
        """Take memory for one's own."""
        from fivebar_pin.control.views import asked, results
        from fivebar_pin.engine import single

        seal(I)  # compiled code is for one that cannot be written
        own = {"chain": chain, "_I": I, "_W": W, "_engine": single, "_shape": (chain.na,)}
        own |= {"_frames": {}, "_pushes": {(): pushes_at(chain, ())}, "_lock": threading.Lock()}
        for name, content in {**own, **asked(I, W), **results(I, W)}.items():
            object.__setattr__(self, name, content)

    def _enter(self) -> None:
        """Keep other threads out."""
        if not self._lock.acquire(blocking=False):
            raise InvalidInputError("evaluator", self, "is at work in another thread", "Give each thread its copy().")

    def _stand(self, q: Array) -> None:
        """Go to a closed configuration."""
        self._enter()
        try:
            self._q[:] = q
            self._compute(self._engine.STAND, self._pushes[()])
        except BaseException:
            self._now[:] = self._then
            raise
        finally:
            self._lock.release()

    def _run(
        self, task: int, x: npt.ArrayLike, v: npt.ArrayLike, name: str, third: npt.ArrayLike,
        external: Mapping[str, npt.ArrayLike] | None,
    ) -> None:  # fmt: skip
        """Write what is asked for into memory and compute; where it cannot be done, go back."""
        shape = self._shape
        self._enter()
        try:
            self._x[:] = x if _plain(x, shape) else checked("q_actuated", x, shape)
            self._v[:] = v if _plain(v, shape) else checked("v_actuated", v, shape)
            self._third[:] = third if _plain(third, shape) else checked(name, third, shape)
            self._compute(task, self._pushed(external) if external else self._pushes[()])
        except BaseException:
            self._now[:] = self._then
            raise
        finally:
            self._lock.release()

    def _pushed(self, external: Mapping[str, npt.ArrayLike]) -> Pushes:
        """Write forces from outside where the engine takes them."""
        names = tuple(external)
        pushes = self._pushes.get(names)
        if pushes is None:
            require_frames(self.chain, names)
            pushes = self._pushes[names] = pushes_at(self.chain, names)
        for room, (name, wrench) in zip(pushes.wrenches[0], external.items(), strict=True):
            room[:] = wrench if _plain(wrench, (6,)) else checked(f"external[{name!r}]", wrench, (6,))
        return pushes

    def _compute(self, task: int, pushes: Pushes) -> None:
        """Do what is asked for, or say why not."""
        status = self._engine.sample(self._I, self._W, task, pushes.links, pushes.points, pushes.wrenches)
        if status:
            from fivebar_pin.control.refusals import refusal

            raise refusal(self.chain, self._I, self._W, status, task, pushes)


def _again(chain: ClosedChain, I: Integers, W: Array) -> Evaluator:
    """Make an evaluator of memory that stands somewhere already."""
    made = Evaluator.__new__(Evaluator)
    made._bind(chain, I, W)
    return made


def _plain(x: npt.ArrayLike, shape: tuple[int, ...]) -> bool:
    """Tell whether an argument is numbers of the right shape as it is; the engine looks whether they are finite."""
    return type(x) is np.ndarray and x.dtype is _FLOAT and x.shape == shape
