"""Design of the next run: which experiment would separate what these data leave open."""
