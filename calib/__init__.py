"""Where in millimetres is this pixel, and how surely? For any flat scene."""
