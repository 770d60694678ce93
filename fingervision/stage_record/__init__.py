"""What a stage's record says, wherever it comes from: its noise, its encoder's step and lines, the record smoothed."""
