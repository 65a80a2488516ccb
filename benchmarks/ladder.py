"""Cost per sample of the generic road on N five-bars, side by side and stacked, N = 1 to 32."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

import fivebar_pin as fb
from benchmarks.timing import best_of
from fivebar_pin import paper

HEADINGS = ("five-bars", "side by side", "per five-bar", "stacked", "per five-bar")
SIZES = (1, 2, 4, 8, 16, 32)
SAMPLES = 500


def row(count: int, *, stacked: bool) -> tuple[fb.ClosedChain, fb.Motion, np.ndarray]:
    """Return `count` copies of the five-bar, on the ground or each on the first link of the one before."""
    linkage = paper.table_1("I", "unbalanced")
    one = linkage.chain()
    source, model = one.model, pin.Model()
    closures, actuated, base = [], [], 0
    for k in range(count):
        ids = [base]
        for j in range(1, source.njoints):
            placement = source.jointPlacements[j]
            if source.parents[j] == 0 and k and not stacked:
                placement = pin.SE3(np.eye(3), np.array([0.3 * k, 0.0, 0.0])) * placement
            ids.append(model.addJoint(ids[source.parents[j]], source.joints[j], placement, f"{source.names[j]}_{k}"))
            model.appendBodyToJoint(ids[j], source.inertias[j], pin.SE3.Identity())
        for name in one.closures[0].frames:
            frame = source.frames[source.getFrameId(name)]
            model.addFrame(pin.Frame(f"{name}_{k}", ids[frame.parentJoint], frame.placement, pin.FrameType.OP_FRAME))
        closures.append(fb.Closure((f"O3_link2_{k}", f"O3_link3_{k}"), "3d"))
        actuated += [f"psi_{k}", f"gamma_{k}"]
        base = ids[source.getJointId("psi")] if stacked else 0
    model.gravity.linear = np.zeros(3)
    motion = paper.default_motion(samples=SAMPLES)
    q0 = linkage.configuration(*motion.q[0], mode=paper.AssemblyMode.LEFT)
    many = fb.Motion(motion.t, *(np.tile(x, (1, count)) for x in (motion.q, motion.v, motion.a)))
    return fb.ClosedChain(model, tuple(closures), tuple(actuated)), many, np.tile(q0, count)


def rows() -> tuple[list[tuple[str, ...]], float, float]:
    """Measure; return the table and the fitted exponents (side by side, stacked) over the larger half."""
    out, times = [], []
    for count in SIZES:
        pair = []
        for stacked in (False, True):
            chain, motion, q0 = row(count, stacked=stacked)
            pair.append(best_of(lambda: fb.inverse_dynamics(chain, fb.drive(chain, motion, near=q0)))[0] / SAMPLES)  # noqa: B023
        times.append(pair)
        cells = [x for t in pair for x in (f"{1e6 * t:.3g} us", f"{1e6 * t / count:.3g} us")]
        out.append((f"{count}", *cells))
    slope = [float(np.polyfit(np.log(SIZES), np.log([t[k] for t in times]), 1)[0]) for k in range(2)]
    return out, slope[0], slope[1]
