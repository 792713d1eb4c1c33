"""Winches with CiA-402 drives: state machine, process data, buses, limits. One file a concept."""
