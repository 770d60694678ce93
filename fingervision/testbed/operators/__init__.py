"""The operator, who does the manual steps of a recipe, and the terminal through which she is asked."""
