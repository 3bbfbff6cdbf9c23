"""Fitting: each stage's settings for one room, from the scan's spacing and the tour file.

A stage takes lengths; a publisher gives a few or none. What is left out follows from how far
apart the scan's points lie. Each function here runs one stage so fitted; its own settings, what
the tour file says, are what enters the stage's key.
"""
