"""Closed-chain dynamics and balancing on Pinocchio."""
