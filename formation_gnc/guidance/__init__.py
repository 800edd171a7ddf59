"""Guidance: formations, target paths, slot assignment, predicted separations."""
