"""Analysis of a recorded stage position from any source: noise, encoder step, encoder lines, smoothing."""
