"""Design of trials: which manoeuvre tells most about a boat, within limits that it and its crew have."""
