"""`python -m fivebar_pin` is the command line."""

from fivebar_pin.cli import script

script()
