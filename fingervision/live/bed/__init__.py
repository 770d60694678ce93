"""A test bed in the page: its camera is the source, and its motor obeys whoever may move it."""
