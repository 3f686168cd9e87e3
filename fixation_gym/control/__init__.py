"""From image to camera twist (servo laws) and from camera twist to joint velocities (resolved rate)."""
