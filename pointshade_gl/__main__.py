"""`python -m pointshade_gl` is the command `pointshade`."""

from .cli import main

main()
