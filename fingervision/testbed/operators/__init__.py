"""The operator, who performs the manual steps of a recipe, and the terminal on which they are requested."""
