"""Devices that behave as real ones do at their plugs, with the simulated platform behind them."""
