"""Camera poses in files, in the words of many programs."""
