"""The attributes that MJCF elements have."""

from __future__ import annotations

__all__ = ["DRIVES", "KNOWN"]

_POSE = "pos quat axisangle xyaxes zaxis euler"
_ATTRIBUTES = f"""
body      name childclass {_POSE} mocap gravcomp user sleep fuse simple
frame     name childclass {_POSE}
joint     name class type group pos axis springdamper limited actuatorfrclimited solreflimit solimplimit
          solreffriction solimpfriction stiffness range actuatorfrcrange actuatorgravcomp margin ref springref
          armature damping frictionloss springyield user
freejoint name group align
inertial  {_POSE} mass diaginertia fullinertia
geom      name class type contype conaffinity condim group priority size material rgba friction mass density
          {_POSE} shellinertia solmix solref solimp margin gap fromto hfield mesh fitscale fluidshape fluidcoef
          castshadow surfacevel adhesion user
site      name class type group {_POSE} material size fromto mesh rgba user
connect   name class active solref solimp body1 body2 anchor site1 site2
weld      name class active solref solimp body1 body2 relpose anchor site1 site2 torquescale
joint_equality   name class active solref solimp joint1 joint2 polycoef
tendon_equality  name class active solref solimp tendon1 tendon2 polycoef
tendon    name class group limited range solreflimit solimplimit solreffriction solimpfriction margin frictionloss
          springlength stiffness damping armature actuatorfrclimited actuatorfrcrange width material rgba
          springyield user
mesh      name class content_type file vertex normal texcoord face refpos refquat scale smoothnormal maxhullvert
          inertia builtin params material
material  name class texture emission specular shininess reflectance metallic roughness rgba texrepeat texuniform
actuator  actdim actearly actlimited actrange area armature bias biasprm biastype body class cogging controller
          cranklength cranksite ctrllimited ctrlrange damping dampratio delay diameter dynprm dyntype ffrange force
          forcelimited forcerange fpmax fvmax gain gainprm gaintype gear group imax inductance inheritrange input
          instance interp joint jointinparent ki kp kv lengthrange lmax lmin lugre motorconst name nominal nsample
          plugin posrange range refsite resistance saturation scale site slewmax slidersite tausmooth tendon thermal
          timeconst user velrange vmax
compiler  alignfree angle assetdir autolimits balanceinertia boundinertia boundmass conflict convexhull coordinate
          discardvisual eulerseq exactmeshinertia fitaabb fusestatic inertiafromgeom inertiagrouprange meshdir
          passthrough savecanonical savecompiled saveinertial settotalmass strippath texturedir usethread
"""


DRIVES = (
    "adhesion", "cylinder", "damper", "dcmotor", "general", "intvelocity", "motor", "muscle", "orientation",
    "pid", "plugin", "position", "velocity",
)  # fmt: skip
"""Elements of the actuator section."""


def _table(text: str) -> dict[str, list[str]]:
    table: dict[str, list[str]] = {}
    for line in text.strip().splitlines():
        words = line.split()
        if line[0] != " ":
            table[words.pop(0)] = words
        else:
            table[list(table)[-1]] += words
    return table


KNOWN = _table(_ATTRIBUTES)
"""Attributes that an element may have; another one is an error, so that no misspelt value is silently a default."""
