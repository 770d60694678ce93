"""Frame sources: one a file; each yields frames in order, with the source's own times."""
