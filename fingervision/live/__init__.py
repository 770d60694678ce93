"""The live view: a continuous source, measured frame by frame, shown in a browser or a terminal, and recorded."""
