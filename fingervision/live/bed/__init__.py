"""A test bed in the page: its camera is the source, and its motor is controlled by users with permission."""
