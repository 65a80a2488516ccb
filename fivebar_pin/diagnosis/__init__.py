"""Diagnosis: what the closures of a chain allow, whether its motors determine it, and what is wrong with it."""

from fivebar_pin.diagnosis.examine import diagnose
from fivebar_pin.diagnosis.report import ActuatedSet, Actuation, Diagnosis, Finding, RedundantRow

__all__ = [
    "ActuatedSet",
    "Actuation",
    "Diagnosis",
    "Finding",
    "RedundantRow",
    "diagnose",
]
