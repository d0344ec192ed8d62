"""Measuring: analytic scenes with exact answers, and what they say about speed and accuracy."""
