"""Reports of a diagnosis: regions of disagreement, plots, the HTML page, and the files."""
