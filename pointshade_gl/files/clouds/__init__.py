"""Point clouds from files: one module for each family of formats, and what all of them need afterwards."""
