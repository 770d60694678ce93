"""Properties of a recorded stage position from any source: noise, encoder step, encoder lines, smoothed record."""
