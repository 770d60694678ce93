"""A recording goes in; the gap over time, its uncertainty and its pictures come out."""
