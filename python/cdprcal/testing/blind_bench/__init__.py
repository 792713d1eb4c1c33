"""Blind tests of the diagnosis: hidden effects, a simulator with other physics code, a score.

``python -m cdprcal.blind_bench run --help`` says how to run a study, ``… report --help`` how to
read one. The logs come from the dynamic simulator (``cpp/cdprcal/simulator``), which shares no
physics code with the estimator; the diagnosis sees the log and the nominal robot alone.
"""
