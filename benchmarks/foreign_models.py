"""The paper's five-bar in the words of other engines, read off our chain: mass centres on the bars, no gravity."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable

import numpy as np

import fivebar_pin as fb

TURN = 2.0 * math.pi
"""Of the motion, one second long [rad/s]."""

Law = tuple[Callable[[float], float], Callable[[float], float]]

CRANKS: dict[str, Law] = {
    "psi": (lambda t: TURN * t - math.sin(TURN * t), lambda t: TURN * (1.0 - math.cos(TURN * t))),
    "gamma": (
        lambda t: math.pi / 3.0 + math.pi / 6.0 * (1.0 - math.cos(TURN * t)),
        lambda t: math.pi / 6.0 * TURN * math.sin(TURN * t),
    ),
}
"""Angle and velocity of the cranks in `paper.default_motion`, for engines that call back."""


def mujoco_model(chain: fb.ClosedChain):
    """Return the model with its joints in our order, the loop closed by an equality of two sites."""
    import mujoco

    model = chain.model
    x = {name: float(model.jointPlacements[model.getJointId(name)].translation[0]) for name in chain.joints}
    tip = {
        name: float(model.frames[model.getFrameId(name)].placement.translation[0]) for name in chain.closures[0].frames
    }

    def body(joint: str, inside: str) -> str:
        inertia = model.inertias[model.getJointId(joint)]
        moments = " ".join(repr(float(moment)) for moment in np.diag(inertia.inertia))
        return f"""<body pos="{x[joint]!r} 0 0"><joint name="{joint}" axis="0 0 1"/>
            <inertial pos="{float(inertia.lever[0])!r} 0 0" mass="{inertia.mass!r}" diaginertia="{moments}"/>
            {inside}</body>"""

    left = body("psi", body("theta_psi", f'<site name="left" pos="{tip["O3_link2"]!r} 0 0"/>'))
    right = body("gamma", body("phi_gamma", f'<site name="right" pos="{tip["O3_link3"]!r} 0 0"/>'))
    return mujoco.MjModel.from_xml_string(f"""<mujoco><option gravity="0 0 0" jacobian="dense"/>
        <worldbody>{right}{left}</worldbody>
        <equality><connect site1="left" site2="right"/></equality></mujoco>""")


def drake_plant(chain: fb.ClosedChain):
    """Return the open tree, and frame and place of the two points that meet."""
    from pydrake.math import RigidTransform
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.multibody.tree import FixedOffsetFrame, RevoluteJoint, RotationalInertia, SpatialInertia

    plant, model = MultibodyPlant(0.0), chain.model
    bodies = [plant.world_body()]
    for j in range(1, model.njoints):
        inertia, name, parent = model.inertias[j], model.names[j], bodies[model.parents[j]]
        central = RotationalInertia(*np.diag(inertia.inertia))
        own = SpatialInertia.MakeFromCentralInertia(inertia.mass, inertia.lever, central)
        bodies.append(plant.AddRigidBody(f"{name}_link", own))
        place = RigidTransform(model.jointPlacements[j].translation)
        frame = plant.AddFrame(FixedOffsetFrame(f"{name}_at", parent.body_frame(), place))
        plant.AddJoint(RevoluteJoint(name, frame, bodies[-1].body_frame(), [0.0, 0.0, 1.0]))
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
    plant.Finalize()
    ends = [model.frames[model.getFrameId(name)] for name in chain.closures[0].frames]
    return plant, [(bodies[f.parentJoint].body_frame(), f.placement.translation.reshape(3, 1)) for f in ends]


def exudyn_system(chain: fb.ClosedChain, q: np.ndarray, cranks: dict[str, Law]):
    """Return the system at a configuration, its cranks held to laws, and the sensors of what holds them."""
    import exudyn as exu
    from exudyn import itemInterface as items

    system = exu.SystemContainer()
    mbs, model = system.AddSystem(), chain.model
    ground = mbs.AddObject(items.ObjectGround())

    def pin(body, x, other, y):
        ends = [
            items.MarkerBodyPosition(bodyNumber=b, localPosition=[at, 0.0, 0.0]) for b, at in ((body, x), (other, y))
        ]
        mbs.AddObject(items.ObjectJointRevolute2D(markerNumbers=[mbs.AddMarker(end) for end in ends]))

    links = [(ground, None, 0j, 0.0, 0.0)]  # body, node, place of its joint, angle, mass centre along it
    for j in range(1, model.njoints):
        parent, _, origin, angle, centre = links[model.parents[j]]
        x, inertia = float(model.jointPlacements[j].translation[0]), model.inertias[j]
        here, turned, along = origin + cmath.rect(x, angle), angle + float(q[j - 1]), float(inertia.lever[0])
        at = here + cmath.rect(along, turned)
        node = mbs.AddNode(items.NodeRigidBody2D(referenceCoordinates=[at.real, at.imag, turned]))
        own = {"mass": inertia.mass, "inertia": float(inertia.inertia[2, 2]), "nodeNumber": node}
        links.append((mbs.AddObject(items.ObjectRigidBody2D(**own)), node, here, turned, along))
        pin(parent, x - centre, links[j][0], -along)
    ends = [model.frames[model.getFrameId(name)] for name in chain.closures[0].frames]
    (one, _, _, _, c1), (two, _, _, _, c2) = (links[f.parentJoint] for f in ends)
    pin(one, float(ends[0].placement.translation[0]) - c1, two, float(ends[1].placement.translation[0]) - c2)
    sensors = [_held(mbs, links[model.getJointId(name)][1], cranks[name]) for name in chain.actuated]
    mbs.Assemble()
    return mbs, sensors


def _held(mbs, node, law: Law):
    """Hold the angle of a node to a law; return the sensor of the torque."""
    import exudyn as exu
    from exudyn import itemInterface as items

    angle, velocity = law
    start = angle(0.0)
    still = mbs.AddNode(items.NodePointGround())
    markers = [items.MarkerNodeCoordinate(nodeNumber=n, coordinate=c) for n, c in ((still, 0), (node, 2))]
    crank = mbs.AddObject(
        items.ObjectConnectorCoordinate(
            markerNumbers=[mbs.AddMarker(marker) for marker in markers],
            offsetUserFunction=lambda _, t, *__: angle(t) - start,
            offsetUserFunction_t=lambda _, t, *__: velocity(t),
        )
    )
    kind = exu.OutputVariableType.Force
    return mbs.AddSensor(items.SensorObject(objectNumber=crank, storeInternal=True, outputVariableType=kind))
