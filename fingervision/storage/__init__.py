"""Every file format in one place."""
