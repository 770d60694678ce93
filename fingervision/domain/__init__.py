"""The nouns: frozen records with their units, shared by every layer above."""
