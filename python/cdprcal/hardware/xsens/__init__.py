"""Xsens MTi AHRS over a serial port: frames, measurements, the device."""
