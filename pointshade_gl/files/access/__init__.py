"""Files and folders themselves: what may be opened, how much is read, what lies where, writing whole."""
