"""What a posterior, a boat or a log says, as numbers and sentences; pages and figures are made of them elsewhere."""
