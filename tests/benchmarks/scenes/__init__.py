"""What stands before the camera of a lab: gripped parts, whole grippers, untidy scenes, and pictures without fingers.

A renderer of its own: outlines are polygons, covered by Agg's scanline rasteriser (area coverage, 1/256 px), painted
one over the other. It shares no code with the product, nor with `camera_artefacts`.
"""
