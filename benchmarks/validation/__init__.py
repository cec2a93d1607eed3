"""Validation of the physics against theory, Cosserat rods and a real robot, in one command."""
