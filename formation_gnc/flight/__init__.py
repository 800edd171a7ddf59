"""What a GNC module is, and the lock-step that joins modules."""
