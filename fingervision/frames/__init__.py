"""Frame sources, one per file; each yields frames in order, with the source's own time stamps."""
