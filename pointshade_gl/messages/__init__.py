"""Everything that users read: errors, notes, spelling suggestions, and the checks of arguments that raise errors."""
