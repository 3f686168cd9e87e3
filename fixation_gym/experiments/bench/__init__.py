"""Times of every stage and of comparable environments."""
