"""Anybody's files as logs: a mapping file says which column is which channel, and is proposed."""

from cdprcal.mapping.apply import load_mapped
from cdprcal.mapping.document import Map, load_map, parse_map
from cdprcal.mapping.proposal import Line, Proposal
from cdprcal.mapping.propose import propose, propose_file
from cdprcal.mapping.raw import Column, RawTable
from cdprcal.mapping.read import read_raw
from cdprcal.mapping.reader import Reader, map_offered

__all__ = [
    "Column",
    "Line",
    "Map",
    "Proposal",
    "RawTable",
    "Reader",
    "load_map",
    "load_mapped",
    "map_offered",
    "parse_map",
    "propose",
    "propose_file",
    "read_raw",
]
