"""What cheap cameras do to a picture: a third renderer, of sampled distance fields, and the measuring's error on it.

It shares no code with `fingervision.rendering` (exact line integrals), and none with the product.
"""
