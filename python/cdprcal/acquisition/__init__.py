"""From power-on to a log: the start-up procedure on any robot, logged while it runs."""

from cdprcal.acquisition.procedure import Acquired, acquire, start_up_plan

__all__ = ["Acquired", "acquire", "start_up_plan"]
