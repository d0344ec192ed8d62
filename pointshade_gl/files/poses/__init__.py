"""Reads camera poses from files of many programs."""
