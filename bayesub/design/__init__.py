"""Design of trials: which manoeuvre determines most of a boat, within limits that it and its crew have."""
