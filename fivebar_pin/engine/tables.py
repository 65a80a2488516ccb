"""The numbers of a chain as the engine sees them, and where everything stands.

    I    integers: how the chain is made; the same for every design
    W    floats: first the constants of the design (lengths, masses, springs), behind them the working memory for the
         sample at hand; every thread has its own

A record is some integers in a row; records of links, rows, blocks and so on stand one kind after the other. Most of
their fields are places in W, so that `W[I[k + POSE]]` is the first number of the pose of the link whose record begins
at k. Every joint turns about, or slides along, the z axis of its link; a joint of several axes is several links, and
link 0 is the ground.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

__all__ = ["Integers", "unwritten"]

Integers: TypeAlias = npt.NDArray[np.int64]

# Flags that are set under a condition stand in W: a function that returned them would count references, at 20 ns.

# Numbers of things, in front of I.
NQ, NV, NA, CONSTANTS, MEMORY = range(5)
# Where records begin and end in I.
(
    LINKS, LINKS_END, COLUMNS, COLUMNS_END, CLOSURES, CLOSURES_END, ROWS, ROWS_END, BLOCKS, BLOCKS_END, SPRINGS,
    SPRINGS_END, MOTORS,
) = range(5, 18)  # fmt: skip
# Places in W: of constants, of the sample at hand, of the points of the branch before it.
(
    GRAVITY, SCALE, LOSSES, MISFIT, Q_HERE, V_HERE, A_HERE, X, MOVED, TARGET, JOINT, TAU, SHAKING, CARRIED, RHS,
    RAW_RHS, RESIDUALS, J_HERE, N_HERE, N_LAST, N_SECOND, Q_BEFORE, J_BEFORE, SIGNS, SIGNS_BEFORE, NORMS, NORMS_BEFORE,
    REACH, LAST_STEP, SECOND_STEP, POSES, RATES, LOADS, JACOBIAN, CLOSED, GOING, STATUS, TO, TO_V, TO_A,
    M_BAR, SETTLED,
) = range(18, 60)  # fmt: skip
HEADER = 60

# Fields of a link.
(
    KIND, Q, V, DOF, COLUMN0, PARENT_POSE, POSE, FIXED, PARENT_RATE, RATE, PARENT_LOAD, LOAD, PARENT_TWIST, TWIST, MASS,
    REACHED, REACHED_END,
) = range(17)  # fmt: skip
LINK_SIZE = 17
REVOLUTE, TURNING, SLIDE, SCREW, BALL, PLANAR, FREE, EGG = range(1, 9)  # kinds; of a TURNING one q is (cos, sin)

# Fields of a column, that is of a velocity coordinate: places of the axis that it turns about, of the vector that it
# slides along, and of the origin of its link; whether it turns, slides or, as a screw, does both; place of its lead;
# what tells it: the record of a block, or -1 - a for motor a.
AXIS, WAY, CENTRE, MOTION, PITCH, OWNER, QS, QS_KIND = range(8)
COLUMN_SIZE = 8
TURN, SHIFT, HELIX = range(3)

# Fields of a closure and of its entries, the columns that move it. TIES: 0 between frames, 1 of coordinates, 2 of
# their velocities alone.
POSE1, POSE2, RATE1, RATE2, FRAMES, ROW0, ROW0_END, ENTRY0, ENTRY0_END, TIES = range(10)
CLOSURE_SIZE = 10
COLUMN, SIGN, LOCAL, ENTRY_AXIS, ENTRY_WAY, ENTRY_CENTRE, ENTRY_MOTION, ENTRY_PITCH, RATIO = range(9)
ENTRY_SIZE = 9  # LOCAL: place in its block, or -1

# Fields of a row.
SORT, DIRECTION, RESIDUAL, LEAD, WRENCH, JACOBIAN0, ENTRIES, ENTRIES_END, CLOSURE = range(9)
ROW_SIZE = 9
ALONG, TILT, TURNED, LENGTH, SPIN, RATIOS = range(6)

# Fields of a block: its rows (places of their records), its columns (velocity coordinates), its motors; RAW rows are
# mixed to HEIGHT ones where MIX is a place.
ROW_LIST, RAW, COLUMN_LIST, WIDTH, MOTOR_LIST, MOTOR_COUNT, FACTORS, PIVOTS, WEAK, MIX, HEIGHT, NUMBER = range(12)
BLOCK_SIZE = 12

# Fields of a spring: sort, pose, rate and load of the links at its ends or the column of its joint, its numbers.
SPRING_SORT, POSE_A, RATE_A, LOAD_A, POSE_B, RATE_B, LOAD_B, COIL = range(8)
SPRING_SIZE = 8
BETWEEN, AT_JOINT, AT_TURNING = range(3)

# Numbers in W.
ROTATION, ORIGIN, LEADING, ALIGNED, RADII = (
    0,
    9,
    12,
    13,
    14,
)  # of a pose, of a placement; see `Link.pitch`; 1: axes not turned
MASS_CENTRE, MOMENTS = 1, 4  # of a mass; moments xx, xy, yy, xz, yz, zz about the centre
ARMATURE, DAMPING, FRICTION = range(3)  # of losses
SECOND_FRAME = 12  # of frames
OTHER, OFFSET, UNIT = 3, 6, 7  # of a direction: vector of frame 1, of frame 2, x_0, the unit of the row
POINT_B, STIFFNESS, REST, DAMPER, MEETING = 3, 6, 7, 8, 9  # of a coil; MEETING: distance of ends that are one point
OMEGA, VELOCITY, ALPHA, ACCELERATION = 0, 3, 6, 9  # of a rate: of the origin of the link, world axes
FORCE, MOMENT, POINT = 0, 3, 6  # of a load, about the origin of the link, and of the wrench of a row, at a point
ANGULAR, LINEAR = 0, 3  # of a twist


# How following a motion ended, in `STATUS`: where it should; before a singularity, or where nothing closes; at motors
# that closures tie to each other.
FOLLOWED, BLOCKED, TOGETHER = range(3)
ROUNDED = 10.0  # singular value, or rate, up to which rows that contradict each other are one, in misfits [-]
FARTHEST = 1e6  # way of a motor from one sample to the next that is a mistake [rad, or chain lengths]


def unwritten(x: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return an array as entries take those that they read: one layout, read-only, so that they are compiled once."""
    given = np.ascontiguousarray(x).view()
    given.setflags(write=False)
    return given
