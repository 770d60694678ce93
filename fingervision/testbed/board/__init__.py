"""The board between computer and motor controller: an Arduino with the sketch in `firmware`."""
