"""The live view: a source that goes on, measured frame by frame, shown in a browser or a terminal, recorded."""
