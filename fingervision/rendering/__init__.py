"""Scenes with known truth, drawn to frames: blur, noise, light, lens, compression."""
