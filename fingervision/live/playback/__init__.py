"""A recording looked through in the page: scrubbed, stepped, played, and measured by the command `measure`."""
