"""The operator, who performs the manual steps of a recipe, and the terminal that asks for them."""
