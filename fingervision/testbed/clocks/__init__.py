"""The bed's clock, and the clocks of cameras and boards joined to it."""
