"""What the study of the reference posteriors of posteriordb is made of."""
