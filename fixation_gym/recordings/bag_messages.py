"""What messages of ROS hold, as values of this project."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from fixation_gym.errors import UsageError
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.scratch import Float32Array
from fixation_gym.recordings.camera_file import lens_of
from fixation_gym.recordings.trajectory import pose_of
from fixation_gym.types import FloatArray, ImageArray

IMAGE_TYPES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
TRANSFORMS_TYPE = "tf2_msgs/msg/TFMessage"
POSE_TYPES = {
    "geometry_msgs/msg/PoseStamped": "pose",
    "geometry_msgs/msg/PoseWithCovarianceStamped": "pose.pose",
    "nav_msgs/msg/Odometry": "pose.pose",
    "geometry_msgs/msg/TransformStamped": "transform",
}
"""Where the pose is in messages that have one."""
_LENS_MODELS = {
    "": "brown_conrady",
    "plumb_bob": "brown_conrady",
    "rational_polynomial": "brown_conrady",
    "equidistant": "fisheye",
    "fisheye": "fisheye",
}
_COLOUR_CODES = {
    "bgr8": cv2.COLOR_BGR2RGB,
    "rgba8": cv2.COLOR_RGBA2RGB,
    "bgra8": cv2.COLOR_BGRA2RGB,
}
_CHANNELS = {"mono8": 1, "8UC1": 1, "rgb8": 3, "8UC3": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4}
_DEPTH_UNITS_M = {"16UC1": (np.uint16, 1e-3), "mono16": (np.uint16, 1e-3), "32FC1": (np.float32, 1.0)}


def stamp_s(header: Any) -> float:
    """Time of a header, s."""
    return header.stamp.sec + 1e-9 * header.stamp.nanosec


def image_of(message: Any, place: str) -> ImageArray:
    """The picture of an ``Image`` or ``CompressedImage``, shape (H, W, 3) RGB or (H, W).

    Raises:
        UsageError: if its encoding is not known, or the data cannot be decoded.
    """
    if not hasattr(message, "encoding"):
        image = cv2.imdecode(np.asarray(message.data, np.uint8), cv2.IMREAD_COLOR)
        if image is None:
            raise UsageError(f"{place}: a compressed picture cannot be decoded")
        return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), np.uint8)
    encoding = message.encoding
    if encoding not in _CHANNELS:
        raise UsageError(f"{place} has encoding '{encoding}'; pictures may have {', '.join(_CHANNELS)}")
    image = _pixels(message, np.dtype(np.uint8), _CHANNELS[encoding], place)
    code = _COLOUR_CODES.get(encoding)
    return np.ascontiguousarray(image if code is None else cv2.cvtColor(image, code), np.uint8)


def depth_of(message: Any, place: str) -> Float32Array:
    """Depths of an ``Image``, shape (H, W), m; NaN where there is none.

    Raises:
        UsageError: if its encoding is not known.
    """
    encoding = getattr(message, "encoding", "compressed")
    if encoding not in _DEPTH_UNITS_M:
        raise UsageError(f"{place} has encoding '{encoding}'; depths may have {', '.join(_DEPTH_UNITS_M)}")
    kind, unit = _DEPTH_UNITS_M[encoding]
    depth = _pixels(message, np.dtype(kind), 1, place).astype(np.float32) * np.float32(unit)
    return np.where(depth > 0.0, depth, np.float32(np.nan))


def _pixels(message: Any, kind: np.dtype, channels: int, place: str) -> np.ndarray:
    """Shape (H, W) for one channel, else (H, W, channels)."""
    height, width = int(message.height), int(message.width)
    row = width * channels * kind.itemsize
    data = np.asarray(message.data, np.uint8)
    if message.step < row or data.size < height * message.step:
        raise UsageError(f"{place}: {data.size} bytes are too few for {width} x {height} pixels")
    rows = np.ascontiguousarray(data[: height * message.step].reshape(height, message.step)[:, :row])
    pixels = rows.view(kind.newbyteorder(">" if message.is_bigendian else "<"))
    return pixels if channels == 1 else pixels.reshape(height, width, channels)


def camera_of(message: Any, place: str) -> Intrinsics:
    """The camera of a ``CameraInfo``.

    Raises:
        UsageError: if its lens is not known, or K is empty.
    """
    model = message.distortion_model
    if model not in _LENS_MODELS:
        known = ", ".join(name for name in _LENS_MODELS if name)
        raise UsageError(f"{place} has a lens of kind '{model}'; known are {known}; give --camera FILE")
    k = np.asarray(getattr(message, "k", getattr(message, "K", None)), np.float64).reshape(3, 3)
    coefficients = np.asarray(getattr(message, "d", getattr(message, "D", ())), np.float64).tolist()
    try:
        lens = lens_of(coefficients, _LENS_MODELS[model])
        return Intrinsics(message.width, message.height, k[0, 0], k[1, 1], k[0, 2], k[1, 2], lens)
    except ValueError as error:
        raise UsageError(f"{place}: {error}; give --camera FILE") from error


def pose_in(message: Any, kind: str, place: str) -> FloatArray:
    """The pose of a message of one of ``POSE_TYPES``, shape (7,), quaternion (w, x, y, z)."""
    value = message
    for name in POSE_TYPES[kind].split("."):
        value = getattr(value, name)
    position = value.translation if hasattr(value, "translation") else value.position
    turn = value.rotation if hasattr(value, "rotation") else value.orientation
    return pose_of([position.x, position.y, position.z, turn.w, turn.x, turn.y, turn.z], place)
