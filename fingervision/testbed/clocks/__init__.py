"""The test bed's clock, and its synchronisation with the clocks of cameras and boards."""
