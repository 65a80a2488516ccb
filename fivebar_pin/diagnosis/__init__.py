"""Diagnosis: what the closures of a chain allow, whether its motors determine it, and what is wrong with it."""

from fivebar_pin.diagnosis.examine import diagnose
from fivebar_pin.diagnosis.motors import MotorProposal, propose_motors
from fivebar_pin.diagnosis.proposals import Evidence, Proposal, propose_closures
from fivebar_pin.diagnosis.report import ActuatedSet, Actuation, Diagnosis, Finding, RedundantRow

__all__ = [
    "ActuatedSet",
    "Actuation",
    "Diagnosis",
    "Evidence",
    "Finding",
    "MotorProposal",
    "Proposal",
    "RedundantRow",
    "diagnose",
    "propose_closures",
    "propose_motors",
]
