# What `from vision import ...` offers: `__init__.py` reads the names and their modules from here.
from .camera import FixedView as FixedView, box_camera as box_camera, fixed_camera as fixed_camera
from .camera import fused_camera as fused_camera, moving_camera as moving_camera
from .errors import VideoBroken as VideoBroken, VisionError as VisionError
from .networks.box_detector import ImageBoxes as ImageBoxes
from .networks.stored_detections import StoredDetections as StoredDetections
from .objects import VisionObjects as VisionObjects
from .settings import VisionSettings as VisionSettings
from .video.frame import Frame as Frame
from .video.frames import open_video as open_video
