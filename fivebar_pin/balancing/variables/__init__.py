"""What the optimiser may change, as variables and cones."""

from __future__ import annotations

__all__: list[str] = []
