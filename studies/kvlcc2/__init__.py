"""The trials of the tanker KVLCC2: what the study of this name needs."""
