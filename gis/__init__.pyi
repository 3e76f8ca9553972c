# What `from gis import ...` offers: `__init__.py` reads the names and their modules from here.
from .cameras.camera import GroundCamera as GroundCamera
from .errors import GisError as GisError
from .frames import LocalFrame as LocalFrame
from .roads.geojson import read_geojson as read_geojson
from .roads.lane_graph import LaneGraph as LaneGraph, LanePlaces as LanePlaces
from .roads.lanes import Connection as Connection, Lane as Lane
from .roads.road_network import RoadNetwork as RoadNetwork, RoadPositions as RoadPositions
from .roads.sumo_net import read_sumo_net as read_sumo_net
