"""One image step a file, in the paper's order; ``pipeline`` alone knows the order."""
