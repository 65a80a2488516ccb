"""The paper's five-bar in other engines: torque of both motors from one motion, with the elimination that a user does.

Every engine, this library too, is checked against the closed form of the paper before it is timed. MuJoCo and Drake
compute the same quantity: the torques are equal to round-off. Exudyn steps through the motion with both cranks held to
it, and is right to the order of its integrator. An engine that is not installed is left out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import fivebar_pin as fb
from benchmarks import foreign_models as models
from benchmarks.handwritten import HandLoop
from benchmarks.positions import closed_form
from benchmarks.timing import best_of
from fivebar_pin import paper

HEADINGS = ("engine", "given", "gives", "n = 1", "n = 1000", "worst difference")
SAMPLES = (1, 1000)
SAME = 1e-9
"""Difference of torques that are one, over the largest [-]."""
STEPPED = 2e-3
"""The same where an integrator of second order takes a thousand steps over the motion [-]."""


@dataclass(frozen=True)
class Task:
    """Some samples of the motion, consistent q, v, a for engines that want them, and the torque in closed form."""

    chain: fb.ClosedChain
    motion: fb.Motion
    trajectory: fb.Trajectory
    torque: np.ndarray


Run = Callable[[Task], np.ndarray]
"""From samples to the torque of psi and gamma (n, 2)."""


@dataclass(frozen=True)
class Engine:
    """A line of the table.

    Attributes:
        name: the engine, and what of it is called.
        given: what it is given.
        gives: what comes out in the time that is measured.
        make: prepares it for a chain; raises ImportError where it is not installed.
        bound: difference of torques allowed, over the largest [-].
        settled: samples left out of the comparison, in which an integrator forgets its start; it is timed for many
            samples alone.
    """

    name: str
    given: str
    gives: str
    make: Callable[[Task], Run]
    bound: float = SAME
    settled: int = 0


def rows() -> tuple[list[tuple[str, ...]], list[str]]:
    """Check and measure every engine, per sample; return the table, and a line for each engine that is missing."""
    out, missing = [], []
    tasks = [_task(paper.table_1("I", "unbalanced"), n) for n in SAMPLES]
    for engine in ENGINES:
        try:
            run = engine.make(tasks[-1])
        except ImportError as error:
            missing.append(f"{engine.name} is left out: {error}")
            continue
        worst = _difference(run, tasks[-1], engine.settled)
        if not worst < engine.bound:
            raise RuntimeError(f"{engine.name}: torques differ by {worst:.1e} of the largest")
        times = ["-" if engine.settled >= len(task.motion) else _per_sample(run, task) for task in tasks]
        out.append((engine.name, engine.given, engine.gives, *times, f"{worst:.1e}"))
    return out, missing


def _task(linkage: paper.FiveBar, n: int) -> Task:
    motion = paper.default_motion(samples=max(n, 2))
    if n == 1:
        motion = fb.Motion(motion.t[1:], motion.q[1:], motion.v[1:], motion.a[1:])
    chain, mode = linkage.chain(), paper.AssemblyMode.LEFT
    trajectory = fb.drive(chain, motion, near=linkage.configuration(*motion.q[0], mode=mode))
    return Task(chain, motion, trajectory, paper.solve(linkage, motion, mode=mode).torque)


def _difference(run: Run, task: Task, settled: int) -> float:
    difference = np.abs(run(task) - task.torque)[settled:]
    return float(difference.max() / np.abs(task.torque).max())


def _per_sample(run: Run, task: Task) -> str:
    return f"{1e6 * best_of(lambda: run(task))[0] / len(task.motion):.3g} us"


def _ours(first: Task) -> Run:
    chain = first.chain

    def run(task: Task) -> np.ndarray:
        return fb.inverse_dynamics(chain, fb.drive(chain, task.motion, near=task.trajectory.q[0])).torque

    return run


def _ours_given(first: Task) -> Run:
    return lambda task: fb.inverse_dynamics(first.chain, task.trajectory).torque


def _pinocchio(first: Task) -> Run:
    q0 = first.trajectory.q[0]
    hand = HandLoop(first.chain, q0, closed_form(first.chain, q0))
    return lambda task: hand.run(task.motion)[0]


def _mujoco_inverse(first: Task) -> Run:
    """`mj_inverse` with the loop as an equality: its Jacobian is MuJoCo's, its soft force is taken out again."""
    import mujoco

    model = models.mujoco_model(first.chain)
    data = mujoco.MjData(model)
    actuated, passive = first.chain.actuated_index, first.chain.passive_index

    def run(task: Task) -> np.ndarray:
        q, v, a = task.trajectory.q, task.trajectory.v, task.trajectory.a
        torque = np.empty((len(q), 2))
        for k in range(len(q)):
            data.qpos[:], data.qvel[:], data.qacc[:] = q[k], v[k], a[k]
            mujoco.mj_inverse(model, data)
            mujoco.mj_rnePostConstraint(model, data)  # cfrc_int: the wrenches on the frame
            J, tau = data.efc_J.reshape(-1, 4)[:2], data.qfrc_inverse + data.qfrc_constraint
            torque[k] = tau[actuated] - J[:, actuated].T @ np.linalg.solve(J[:, passive].T, tau[passive])
        return torque

    return run


def _mujoco_rne(first: Task) -> Run:
    """`mj_rne` on the open tree, and the Jacobians of the two points that meet."""
    import mujoco

    model = models.mujoco_model(first.chain)
    data, tau, left, right = mujoco.MjData(model), np.zeros(4), np.zeros((3, 4)), np.zeros((3, 4))
    actuated, passive = first.chain.actuated_index, first.chain.passive_index

    def run(task: Task) -> np.ndarray:
        q, v, a = task.trajectory.q, task.trajectory.v, task.trajectory.a
        torque = np.empty((len(q), 2))
        for k in range(len(q)):
            data.qpos[:], data.qvel[:], data.qacc[:] = q[k], v[k], a[k]
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            mujoco.mj_comVel(model, data)
            mujoco.mj_rne(model, data, 1, tau)
            mujoco.mj_jacSite(model, data, left, None, 0)
            mujoco.mj_jacSite(model, data, right, None, 1)
            J = (left - right)[:2]
            torque[k] = tau[actuated] - J[:, actuated].T @ np.linalg.solve(J[:, passive].T, tau[passive])
        return torque

    return run


def _mujoco_motors(first: Task) -> Run:
    """The same from the motors alone: positions in closed form, rates by the complement, drift by `mj_jacDot`."""
    import mujoco

    model, position = models.mujoco_model(first.chain), closed_form(first.chain, first.trajectory.q[0])
    data, tau = mujoco.MjData(model), np.zeros(4)
    left, right, left_dot, right_dot = (np.zeros((3, 4)) for _ in range(4))
    actuated, passive, bodies = first.chain.actuated_index, first.chain.passive_index, model.site_bodyid.tolist()
    N = np.zeros((4, 2))
    N[actuated, [0, 1]] = 1.0

    def run(task: Task) -> np.ndarray:
        motion, torque = task.motion, np.empty((len(task.motion), 2))
        ends = data.site_xpos
        for k in range(len(motion)):
            data.qpos[:] = position(motion.q[k].tolist())
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            mujoco.mj_jacSite(model, data, left, None, 0)
            mujoco.mj_jacSite(model, data, right, None, 1)
            J = (left - right)[:2]
            Jp = J[:, passive]
            N[passive] = -np.linalg.solve(Jp, J[:, actuated])
            data.qvel[:] = v = N @ motion.v[k]
            mujoco.mj_comVel(model, data)
            mujoco.mj_jacDot(model, data, left_dot, None, ends[0], bodies[0])
            mujoco.mj_jacDot(model, data, right_dot, None, ends[1], bodies[1])
            a = N @ motion.a[k]
            a[passive] -= np.linalg.solve(Jp, (left_dot - right_dot)[:2] @ v)
            data.qacc[:] = a
            mujoco.mj_rne(model, data, 1, tau)
            torque[k] = N.T @ tau
        return torque

    return run


def _drake(first: Task) -> Run:
    """`CalcInverseDynamics` on the open tree, and the Jacobians of the two points that meet."""
    from pydrake.multibody.tree import JacobianWrtVariable, MultibodyForces

    plant, ends = models.drake_plant(first.chain)
    context, world, wrt = plant.CreateDefaultContext(), plant.world_frame(), JacobianWrtVariable.kV
    forces = MultibodyForces(plant)
    at = [plant.GetJointByName(name).velocity_start() for name in first.chain.joints]
    order = np.argsort(at)
    actuated, passive = (np.array(at)[index] for index in (first.chain.actuated_index, first.chain.passive_index))

    def run(task: Task) -> np.ndarray:
        q, v, a = (getattr(task.trajectory, x)[:, order] for x in "qva")
        state, torque = np.concatenate([q, v], axis=1), np.empty((len(q), 2))
        for k in range(len(q)):
            plant.SetPositionsAndVelocities(context, state[k])
            tau = plant.CalcInverseDynamics(context, a[k], forces)
            left, right = (plant.CalcJacobianTranslationalVelocity(context, wrt, f, p, world, world) for f, p in ends)
            J = (left - right)[:2]
            torque[k] = tau[actuated] - J[:, actuated].T @ np.linalg.solve(J[:, passive].T, tau[passive])
        return torque

    return run


def _exudyn(first: Task) -> Run:
    """Plane bodies and pins, both cranks held to the motion, the torques read off as what holds them."""
    import exudyn as exu

    steps, end = len(first.motion) - 1, float(first.motion.t[-1])
    mbs, sensors = models.exudyn_system(first.chain, first.trajectory.q[0], models.CRANKS)
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps, settings.timeIntegration.endTime = steps, end
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.6  # forgets within 50 steps that it starts with a jerk
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = end / steps

    def run(task: Task) -> np.ndarray:
        mbs.SolveDynamic(settings)
        return -np.column_stack([mbs.GetSensorStoredData(sensor)[:, 1] for sensor in sensors])  # by the crank

    return run


ENGINES = (
    Engine("this library", "motion of the motors", "torque, shaking wrench", _ours),
    Engine("this library", "q, v, a", "torque, shaking wrench", _ours_given),
    Engine("Pinocchio, hand-written loop", "motion of the motors", "torque, shaking wrench", _pinocchio),
    Engine("MuJoCo, mj_inverse", "q, v, a", "torque, frame wrenches", _mujoco_inverse),
    Engine("MuJoCo, mj_rne", "q, v, a", "torque", _mujoco_rne),
    Engine("MuJoCo, mj_rne", "motion of the motors", "torque", _mujoco_motors),
    Engine("Drake, CalcInverseDynamics", "q, v, a", "torque", _drake),
    Engine("Exudyn, a step", "motion of the motors", "torque, reactions", _exudyn, bound=STEPPED, settled=50),
)
"""One line of the table each."""
