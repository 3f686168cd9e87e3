"""How far the fixated target is."""
