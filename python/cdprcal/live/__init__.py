"""A page that shows a start-up while it runs, or a log as if it ran: on this computer alone."""

from cdprcal.live.feed import Feed, LiveRun, LiveServer
from cdprcal.live.replay import places_of, replay_messages

__all__ = ["Feed", "LiveRun", "LiveServer", "places_of", "replay_messages"]
