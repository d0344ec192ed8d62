"""Measures speed and accuracy on analytic scenes with exact answers."""
