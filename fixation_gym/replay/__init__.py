"""``fixation-gym replay``: perception on recorded pictures, and what comes out against what is known."""
