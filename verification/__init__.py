"""What the project claims, measured against programs that it did not write; see docs/verification/."""
