"""What moves the robot: one protocol, several models."""
