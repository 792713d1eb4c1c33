"""One master a bus: a name that only one program on this computer can hold."""

from __future__ import annotations

import errno
import os
import socket

from cdprcal.hardware.backend import BackendError
from cdprcal.hardware.session import CanopenBus, EthercatBus


class BusLock:
    """Holds a bus until it is released, or this program ends, however it does.

    The name is that of a socket in Linux' abstract namespace: of the network namespace, as
    interfaces are, and without a file that could be left behind. Other systems have none of it.
    Raises BackendError when another program has it.
    """

    def __init__(self, bus: CanopenBus | EthercatBus) -> None:
        self._socket: socket.socket | None = None
        if not hasattr(socket, "AF_UNIX"):
            return
        holder = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            holder.bind(_name(bus))
        except OSError as error:
            holder.close()
            if error.errno != errno.EADDRINUSE:
                return  # a system without such names
            raise BackendError(
                f"{bus.type} bus {bus.interface}: another program on this computer moves a robot "
                "there; end it first"
            ) from None
        self._socket = holder

    def release(self) -> None:
        """Gives the bus back. May be repeated."""
        if self._socket is not None:
            self._socket.close()


def _name(bus: CanopenBus | EthercatBus) -> str:
    parts = ["\0cdprcal", bus.type, bus.interface]
    if isinstance(bus, CanopenBus):
        parts.append(bus.channel)
        if bus.interface == "virtual":
            parts.append(str(os.getpid()))  # such a bus is in one process
    return " ".join(parts)[:100]
