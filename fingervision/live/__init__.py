"""The live view: a camera or stream is measured frame by frame, shown in a browser or a terminal, and recorded."""
