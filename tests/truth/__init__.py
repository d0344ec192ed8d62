"""Truth from an independent path tracer, and how far pictures are from it. See make_truth.py and compare.py."""
