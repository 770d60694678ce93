"""A record of the input -> its path with uncertainty: noise, encoder, corners, rests, and the offset of its clock."""
