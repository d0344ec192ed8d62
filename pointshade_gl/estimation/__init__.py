"""Statistics on the CPU: noise, the light in a photograph, highlights, floors, views that disagree."""
