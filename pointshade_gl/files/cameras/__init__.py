"""Reads camera intrinsics and poses from files of many programs."""
