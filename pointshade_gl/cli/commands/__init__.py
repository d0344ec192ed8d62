"""The commands of `pointshade`."""
