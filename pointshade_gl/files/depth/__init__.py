"""From raw numbers to metres: kinds, units, codings and missing values of depth."""
