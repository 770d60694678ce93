"""Set-ups with one fault each, and good ones, drawn to judge `fingervision inspect`.

The light is sampled from signed distances, as in `tests.benchmarks.camera_artefacts`; nothing of the product is used.
"""
