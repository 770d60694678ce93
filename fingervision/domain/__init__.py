"""Domain types: immutable records with stated units, used by all other packages."""
