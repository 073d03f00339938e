"""Parameter files of the robot."""
