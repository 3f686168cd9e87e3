"""Physically based pictures of the wrist camera, by Mitsuba: glass refracts, mirrors of any form reflect."""
