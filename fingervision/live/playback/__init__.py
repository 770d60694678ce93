"""Playback of a recording in the browser page: seek, step, play, and measurement by the command `measure`."""
