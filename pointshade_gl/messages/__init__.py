"""What users are told: checks of values, wording, suggestions, notes and errors."""
