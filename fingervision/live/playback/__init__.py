"""Playback of a recording in the page: seek, step, play, and measurement by the command `measure`."""
