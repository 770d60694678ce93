"""One clock for the recording and the stage's log: their offset, found from the motion that both show."""
