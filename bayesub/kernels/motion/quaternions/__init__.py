"""What the kernels of motion have instead where the attitude is a quaternion."""
