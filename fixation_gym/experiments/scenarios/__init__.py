"""The paper's Fig. 4: what is in front, in four hard scenes."""
