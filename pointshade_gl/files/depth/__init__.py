"""Converts stored depth values to metres: kinds of depth, units, encodings and missing values."""
