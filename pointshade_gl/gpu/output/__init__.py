"""The last passes: they average samples into a picture, and draw the picture into a window."""
