"""What comes before a run: files are examined, a trial is simulated, and the speed of the machine is measured."""
