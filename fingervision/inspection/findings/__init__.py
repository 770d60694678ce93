"""One limit of a set-up a file; each has `find(sample) -> Finding`. Adding one adds a file (`inspection.catalogue`)."""
