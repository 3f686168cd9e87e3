"""How the image moves."""
