"""ROS bags, of ROS 2 (``.mcap``, ``.db3``, or the folder of a recorder) or ROS 1 (``.bag``), read by ``rosbags``.

Pictures come from one topic, with the times of their headers. The camera is that of ``camera_info`` beside it. Its pose
comes from a topic of poses, or from the transforms (tf) between the frame that the pictures name and the root.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from fixation_gym.errors import UsageError
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.scratch import Float32Array
from fixation_gym.recordings import bag_messages as messages
from fixation_gym.recordings.camera_file import read_camera
from fixation_gym.recordings.options import ReaderOptions
from fixation_gym.recordings.pictures import Forward, check_size
from fixation_gym.recordings.recording import FrameList, RecordedFrame
from fixation_gym.recordings.trajectory import Trajectory
from fixation_gym.recordings.transforms import Link, chain_to, pose_along
from fixation_gym.types import FloatArray, ImageArray

SUFFIXES = (".mcap", ".db3", ".bag")
_DEPTH_WITHIN_S = 0.02
"""A depth picture belongs to a picture that is no farther away than this."""


@dataclass
class _Content:
    """What one pass over a bag collects, but for the pixels."""

    frame_id: str = ""
    times: list[float] = field(default_factory=list)
    depth_times: list[float] = field(default_factory=list)
    camera: Intrinsics | None = None
    pose_times: list[float] = field(default_factory=list)
    poses: list[FloatArray] = field(default_factory=list)
    moving: dict[tuple[str, str], tuple[list[float], list[FloatArray]]] = field(default_factory=dict)
    """Times and poses by child and parent."""
    still: dict[str, Link] = field(default_factory=dict)


def read_bag(path: Path, options: ReaderOptions) -> FrameList:
    """Read a bag.

    Raises:
        UsageError: if ``rosbags`` is not installed, or saying what the bag lacks.
    """
    if importlib.util.find_spec("rosbags") is None:
        raise UsageError(f"{path} is a bag, which needs rosbags: pip install 'fixation-gym[ros]'")
    with _opened(path) as bag:
        kinds = {connection.topic: connection.msgtype for connection in bag.connections}
    pictures = _picture_topic(path, kinds, options.image_topic)
    for topic, option in ((options.depth_topic, "--depth-topic"), (options.pose_topic, "--pose-topic")):
        if topic is not None and topic not in kinds:
            raise UsageError(f"{path} has no topic '{topic}'; choose {option} of {', '.join(sorted(kinds))}")
    content = _collected(path, kinds, pictures, options)
    camera = content.camera if options.camera is None else read_camera(options.camera)
    if camera is None:
        raise UsageError(f"{path} has no camera_info beside {pictures}; give --camera FILE")
    pose_at = _poses(path, content, options)
    images = Forward(partial(_stream, path, pictures))
    depths = Forward(partial(_stream, path, options.depth_topic or ""))
    depth_times = np.array(content.depth_times)
    frames = []
    for k, time in enumerate(content.times):
        place = f"{path}, {pictures} {k}"
        nearest = int(np.argmin(np.abs(depth_times - time))) if depth_times.size else -1
        close = nearest >= 0 and abs(depth_times[nearest] - time) <= _DEPTH_WITHIN_S
        depth = partial(_depth, depths, nearest, camera, f"{path}, {options.depth_topic} {nearest}") if close else None
        frames.append(RecordedFrame(place, time, partial(_image, images, k, camera, place), pose_at(time), depth=depth))
    return FrameList(camera, frames)


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """An opened reader of the bag.

    Raises:
        UsageError: if it cannot be opened or read.
    """
    from rosbags.highlevel import AnyReader, AnyReaderError  # pyright: ignore[reportMissingImports]
    from rosbags.typesys import Stores, get_typestore  # pyright: ignore[reportMissingImports]

    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as bag:
            yield bag
    except (AnyReaderError, OSError) as error:
        raise UsageError(f"{path} cannot be read as a bag: {error}") from error


def _picture_topic(path: Path, kinds: dict[str, str], wanted: str | None) -> str:
    found = sorted(topic for topic, kind in kinds.items() if kind in messages.IMAGE_TYPES)
    if wanted is not None:
        if wanted not in found:
            raise UsageError(f"{path} has no pictures '{wanted}'; choose --image-topic of {', '.join(found) or 'none'}")
        return wanted
    found = [topic for topic in found if "depth" not in topic]
    if len(found) != 1:
        raise UsageError(f"{path} has {len(found)} topics of pictures; choose --image-topic of {', '.join(found)}")
    return found[0]


def _collected(path: Path, kinds: dict[str, str], pictures: str, options: ReaderOptions) -> _Content:
    """All but the pixels, in one pass."""
    content = _Content()
    info_topic = f"{pictures.removesuffix('/compressed').rpartition('/')[0]}/camera_info"
    wanted = {pictures, info_topic, options.depth_topic, options.pose_topic}
    wanted |= {topic for topic, kind in kinds.items() if kind == messages.TRANSFORMS_TYPE}
    for topic, message in _messages(path, [topic for topic in kinds if topic in wanted]):
        if topic == pictures:
            content.times.append(messages.stamp_s(message.header))
            content.frame_id = message.header.frame_id
        elif topic == info_topic:
            content.camera = content.camera or messages.camera_of(message, f"{path}, {topic}")
        elif topic == options.depth_topic:
            content.depth_times.append(messages.stamp_s(message.header))
        elif topic == options.pose_topic:
            _note_pose(content, message, kinds[topic], f"{path}, {topic}")
        else:
            _note_transforms(content, message, topic, f"{path}, {topic}")
    return content


def _messages(path: Path, topics: Sequence[str]) -> Iterator[tuple[str, Any]]:
    with _opened(path) as bag:
        connections = [connection for connection in bag.connections if connection.topic in topics]
        if connections:  # none would stand for all
            for connection, _, data in bag.messages(connections):
                yield connection.topic, bag.deserialize(data, connection.msgtype)


def _note_pose(content: _Content, message: Any, kind: str, place: str) -> None:
    if kind not in messages.POSE_TYPES:
        raise UsageError(f"{place} has messages {kind}; poses may be {', '.join(messages.POSE_TYPES)}")
    content.pose_times.append(messages.stamp_s(message.header))
    content.poses.append(messages.pose_in(message, kind, place))


def _note_transforms(content: _Content, message: Any, topic: str, place: str) -> None:
    for transform in message.transforms:
        child, parent = (name.lstrip("/") for name in (transform.child_frame_id, transform.header.frame_id))
        pose = messages.pose_in(transform, "geometry_msgs/msg/TransformStamped", place)
        if topic.endswith("tf_static"):
            content.still[child] = Link(parent, None, pose)
        else:
            times, poses = content.moving.setdefault((child, parent), ([], []))
            times.append(messages.stamp_s(transform.header))
            poses.append(pose)


def _poses(path: Path, content: _Content, options: ReaderOptions) -> Callable[[float], FloatArray | None]:
    """What gives the camera's pose at a time."""
    if options.pose_topic is not None:
        if not content.poses:
            raise UsageError(f"{path}: topic {options.pose_topic} has no poses")
        return Trajectory(content.pose_times, content.poses).at
    if not content.moving and not content.still:
        raise UsageError(f"{path} has no poses: there are no transforms (tf); give --pose-topic TOPIC")
    moving = {child: Link(parent, Trajectory(*known)) for (child, parent), known in content.moving.items()}
    try:
        chain = chain_to({**content.still, **moving}, content.frame_id.lstrip("/"), options.base_frame)
    except UsageError as error:
        raise UsageError(f"{path}: {error}; or give --pose-topic TOPIC") from None
    return partial(pose_along, chain)


def _stream(path: Path, topic: str) -> Iterator[Any]:
    for _, message in _messages(path, [topic]):
        yield message


def _image(stream: Forward[Any], index: int, camera: Intrinsics, place: str) -> ImageArray:
    image = messages.image_of(stream.at(index), place)
    check_size(image, camera, place)
    return image


def _depth(stream: Forward[Any], index: int, camera: Intrinsics, place: str) -> Float32Array:
    depth = messages.depth_of(stream.at(index), place)
    check_size(depth, camera, place)
    return depth
