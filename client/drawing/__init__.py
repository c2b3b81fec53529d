"""Pictures of frames. The module ``picture`` has the description of a picture; ``render`` draws the picture in a
process of its own.
"""
