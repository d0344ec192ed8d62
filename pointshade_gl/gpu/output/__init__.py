"""The last pass: from samples to a picture, and from a picture to a window."""
