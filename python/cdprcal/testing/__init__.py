"""Test equipment: simulated devices, and the blind bench."""
