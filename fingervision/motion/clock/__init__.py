"""Offset between the clocks of a recording and of the stage's log, found from the motion that both record."""
