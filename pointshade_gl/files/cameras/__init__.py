"""Reads camera intrinsics from files of many programs."""
