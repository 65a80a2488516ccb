"""Constrained kinematics: assemble, drive, complement."""

from fivebar_pin.kinematics.assemble import assemble, closure_residual
from fivebar_pin.kinematics.complement import complement
from fivebar_pin.kinematics.drive import drive
from fivebar_pin.kinematics.frame_motion import FrameMotion, frame_motion
from fivebar_pin.kinematics.modes import assembly_modes

__all__ = [
    "FrameMotion",
    "assemble",
    "assembly_modes",
    "closure_residual",
    "complement",
    "drive",
    "frame_motion",
]
