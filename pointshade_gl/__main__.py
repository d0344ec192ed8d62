"""`python -m pointshade_gl` is the command `pointshade`."""

from .cli.main import main

main()
