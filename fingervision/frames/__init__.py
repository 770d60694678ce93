"""Sources of video frames, one kind per module; each yields frames in order, with the source's own time stamps."""
