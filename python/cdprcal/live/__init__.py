"""A page that shows a start-up while it runs, or a log as if it ran: on this computer alone."""

from cdprcal.live.feed import Feed, LiveRun
from cdprcal.live.replay import places_of, replay_messages
from cdprcal.live.server import LiveServer

__all__ = ["Feed", "LiveRun", "LiveServer", "places_of", "replay_messages"]
