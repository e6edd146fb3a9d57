"""The report of a run, and the cards of a vehicle and of the data of a study."""
