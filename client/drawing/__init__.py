"""Pictures of frames: ``picture`` asks for them, ``render`` draws them in a process of its own."""
