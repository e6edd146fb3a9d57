"""What is asked: the sections of study files and of files like them, and the logs that they name."""
