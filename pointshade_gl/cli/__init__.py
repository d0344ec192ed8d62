"""The command line `pointshade`."""
