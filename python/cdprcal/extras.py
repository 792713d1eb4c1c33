"""Libraries that few need: which extra has them, said before any work is done."""

from __future__ import annotations

from importlib.util import find_spec
from typing import NamedTuple

from cdprcal._core import InputError


class Extra(NamedTuple):
    """Which extra of the package a module is of, what it is for, and what does without it."""

    name: str
    purpose: str
    instead: str = ""


EXTRAS = {
    "matplotlib": Extra("plots", "pictures"),
    "jinja2": Extra("report", "reports"),
    "plotly": Extra("report", "pages in the browser"),
    "mcap": Extra("mcap", "MCAP logs", "take CSV"),
    "rosbags": Extra("ros2", "ROS 2 bags"),
    "can": Extra("canopen", "drives on CANopen"),
    "canopen": Extra("canopen", "drives on CANopen"),
    "msgpack": Extra("canopen", "drives on CANopen"),
    "serial": Extra("xsens", "serial ports"),
    "pysoem": Extra("ethercat", "drives on EtherCAT"),
    "scipy": Extra("mat", "MAT-files", "save as CSV"),
    "h5py": Extra("hdf5", "HDF5 files", "save as CSV"),
    "openpyxl": Extra("excel", "Excel workbooks", "save the sheet as CSV"),
    "pyarrow": Extra("arrow", "Parquet and Feather files", "save as CSV"),
    "pandas": Extra("pandas", "data frames"),
    "distributed": Extra("dask", "studies on a cluster"),
}


def need(*modules: str, of: str = "") -> None:
    """Raises InputError, naming the extra, for the first of these that is not installed.

    ``of``: the file that needs them.
    """
    for module in lacking(*modules):
        raise InputError(f"{of}: {missing(module)}" if of else missing(module))


def lacking(*modules: str) -> list[str]:
    """Those of these modules that are not installed."""
    return [module for module in modules if find_spec(module) is None]


def missing(module: str) -> str:
    """What to do about a module of EXTRAS that is not installed."""
    extra = EXTRAS[module]
    text = f"{extra.purpose} need {module}: pip install 'cdprcal[{extra.name}]'"
    return f"{text}, or {extra.instead}" if extra.instead else text
