"""What the costs of predictions depend on: what the study of this name needs."""
