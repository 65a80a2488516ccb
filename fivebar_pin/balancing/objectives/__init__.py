"""What a design is judged by: the terms of an objective."""

from __future__ import annotations

__all__: list[str] = []
