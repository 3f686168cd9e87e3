"""Where the camera truly sits on the hand, learnt from pictures of the support surface."""
