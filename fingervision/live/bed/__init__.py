"""A test bed in the browser page: the bed's camera is the source, and users with permission control the motor."""
