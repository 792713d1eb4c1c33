"""The whole story on a simulated robot: blind start, plan, acquire, calibrate, diagnose."""
