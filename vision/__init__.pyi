# What `from vision import ...` offers: `__init__.py` reads the names and their modules from here.
from .detection_camera import DetectionVision as DetectionVision, Standing as Standing
from .errors import VideoBroken as VideoBroken, VisionError as VisionError
from .fixed_camera import FixedCameraVision as FixedCameraVision
from .moving_camera import MovingCameraVision as MovingCameraVision
from .networks.box_detector import ImageBoxes as ImageBoxes
from .networks.stored_detections import StoredDetections as StoredDetections
from .objects import VisionObjects as VisionObjects
from .settings import VisionSettings as VisionSettings
from .video.frame import Frame as Frame
from .video.frames import open_video as open_video
