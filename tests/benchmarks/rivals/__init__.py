"""What a user would write instead of the simulator, the arithmetic of the processor, and what a cluster costs."""
