"""One clock for the recording and the stage's log: the offset between them, found from the motion that both record."""
