"""What demonstrates: simulated demonstrators with a known policy."""
