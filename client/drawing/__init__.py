"""Pictures of frames. ``picture`` describes a picture; ``render`` draws the picture in a process of its own."""
