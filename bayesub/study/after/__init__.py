"""What comes after a run: its page again, what it predicts, what others take from it, and the next trial."""
