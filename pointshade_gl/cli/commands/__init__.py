"""The commands of `pointshade`, a file each."""
