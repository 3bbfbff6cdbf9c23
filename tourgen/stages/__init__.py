"""Stages: pure functions of arrays and settings, in the order of the data."""
