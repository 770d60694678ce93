"""What of the manual is made at build time: formulas, and the reference pages that the program itself can write."""
