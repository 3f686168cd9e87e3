"""Bags of ROS 2 and ROS 1 that are written here are read back: pictures, camera, poses by topic and by transforms."""

import importlib.util

import cv2
import numpy as np
import pytest
from made_recordings import CAMERA, COUNT, PERIOD, made_frames, millimetres, write_camera

from fixation_gym.errors import UsageError
from fixation_gym.geometry.camera import Lens
from fixation_gym.geometry.rigid import inverse, look_at, matrix_to_pose, pose_to_matrix
from fixation_gym.recordings.catalogue import open_recording
from fixation_gym.recordings.options import ReaderOptions
from fixation_gym.recordings.trajectory import Trajectory
from fixation_gym.recordings.transforms import Link, chain_to, pose_along

IMAGE, INFO, DEPTH, POSE, STILL = "/eye/image_raw", "/eye/camera_info", "/eye/depth", "/arm/camera_pose", "/tf_static"
HAND_EYE = look_at(np.zeros(3), np.array([0.1, 0.2, 1.0]), np.array([0.0, 1.0, 0.0]))
"""T_hand_eye: the camera in the hand."""


class Bag:
    """Writes messages by the names of their types."""

    def __init__(self, path, version=None):
        from rosbags.rosbag1 import Writer as Writer1
        from rosbags.rosbag2 import StoragePlugin
        from rosbags.rosbag2 import Writer as Writer2
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

        self.ros1 = path.suffix == ".bag"
        self.store = get_typestore(Stores.ROS1_NOETIC if self.ros1 else Stores.ROS2_HUMBLE)
        if self.ros1:  # its store lacks them
            transforms = "geometry_msgs/TransformStamped[] transforms"
            self.store.register(get_types_from_msg(transforms, "tf2_msgs/msg/TFMessage"))
        plugin = StoragePlugin.SQLITE3 if version == "sqlite3" else StoragePlugin.MCAP
        self.writer = Writer1(path) if self.ros1 else Writer2(path, version=9, storage_plugin=plugin)
        self.connections = {}

    def make(self, kind, *values):
        return self.store.types[kind](*values)

    def header(self, time, frame):
        stamp = self.make("builtin_interfaces/msg/Time", int(time), round(1e9 * (time % 1)))
        return self.make("std_msgs/msg/Header", *([0] if self.ros1 else []), stamp, frame)

    def write(self, topic, time, message):
        kind = message.__msgtype__
        if topic not in self.connections:
            self.connections[topic] = self.writer.add_connection(topic, kind, typestore=self.store)
        serialise = self.store.serialize_ros1 if self.ros1 else self.store.serialize_cdr
        self.writer.write(self.connections[topic], round(1e9 * time) + 7, serialise(message, kind))

    def image(self, time, pixels, encoding):
        row = pixels.dtype.itemsize * pixels.shape[1] * (pixels.shape[2] if pixels.ndim == 3 else 1)
        data = np.ascontiguousarray(pixels).view(np.uint8).ravel()
        return self.make(
            "sensor_msgs/msg/Image", self.header(time, "eye_optical"), *pixels.shape[:2], encoding, 0, row, data
        )

    def transform(self, pose, time, parent, child):
        x, y, z, qw, qx, qy, qz = map(float, pose)
        vector, turn = self.make("geometry_msgs/msg/Vector3", x, y, z), self.turn(qx, qy, qz, qw)
        moved = self.make("geometry_msgs/msg/Transform", vector, turn)
        stamped = self.make("geometry_msgs/msg/TransformStamped", self.header(time, parent), child, moved)
        return self.make("tf2_msgs/msg/TFMessage", [stamped])

    def turn(self, *values):
        return self.make("geometry_msgs/msg/Quaternion", *values)

    def pose(self, pose, time):
        x, y, z, qw, qx, qy, qz = map(float, pose)
        point = self.make("geometry_msgs/msg/Point", x, y, z)
        value = self.make("geometry_msgs/msg/Pose", point, self.turn(qx, qy, qz, qw))
        return self.make("geometry_msgs/msg/PoseStamped", self.header(time, "base"), value)

    def info(self, time, lens=(0.0,) * 5, model="plumb_bob"):
        k, numbers = CAMERA.matrix.ravel(), np.zeros(12)
        region = self.make("sensor_msgs/msg/RegionOfInterest", 0, 0, 0, 0, False)
        size = (CAMERA.height, CAMERA.width)
        values = (np.array(lens), k, np.eye(3).ravel(), numbers, 0, 0, region)
        return self.make("sensor_msgs/msg/CameraInfo", self.header(time, "eye_optical"), *size, model, *values)


def write_bag(path, poses="tf", version=None, info=True, encoding="rgb8", **lens):
    """Poses 1 ms after each picture would be interpolated; they are at its time, through a still hand-eye link."""
    bag = Bag(path, version)
    with bag.writer:
        if poses == "tf":
            hand_eye = matrix_to_pose(HAND_EYE)
            bag.write(STILL, 0.0, bag.transform(hand_eye, 0.0, "hand", "eye_optical"))
        for frame in made_frames():
            time = 100.0 + frame.time
            if info:
                bag.write(INFO, time, bag.info(time, **lens))
            pixels = frame.rgb if encoding == "rgb8" else cv2.cvtColor(frame.rgb, getattr(cv2, f"COLOR_RGB2{encoding}"))
            kind = {"rgb8": "rgb8", "BGR": "bgr8", "BGRA": "bgra8", "GRAY": "mono8"}[encoding]
            bag.write(IMAGE, time, bag.image(time, pixels, kind))
            bag.write(DEPTH, time, bag.image(time + 0.004, millimetres(frame.depth), "16UC1"))
            if poses == "tf":
                hand = matrix_to_pose(pose_to_matrix(frame.pose) @ inverse(HAND_EYE))
                bag.write("/tf", time, bag.transform(hand, time, "base", "hand"))
            elif poses == "topic":
                bag.write(POSE, time, bag.pose(frame.pose, time))
    return path


needs_rosbags = pytest.mark.skipif(importlib.util.find_spec("rosbags") is None, reason="the extra ros is not installed")


def check(recording, depth=True):
    assert len(recording) == COUNT
    for frame, true in zip(recording, made_frames(), strict=True):
        assert frame.time == pytest.approx(100.0 + true.time, abs=1e-6)
        np.testing.assert_array_equal(frame.image(), true.rgb)
        np.testing.assert_allclose(pose_to_matrix(frame.camera_pose), pose_to_matrix(true.pose), atol=1e-9)
        if depth:
            np.testing.assert_allclose(frame.depth(), 1e-3 * millimetres(true.depth), rtol=1e-6)


@needs_rosbags
@pytest.mark.parametrize("kind", ["mcap folder", "mcap", "sqlite3", "ros1"])
def test_a_bag_gives_back_what_was_written(kind, tmp_path):
    path = tmp_path / ("a.bag" if kind == "ros1" else "a")
    write_bag(path, version=kind)
    path = next(path.glob("*.mcap")) if kind == "mcap" else path
    recording = open_recording(path, ReaderOptions(depth_topic=DEPTH))
    assert recording.camera == CAMERA
    check(recording)


@needs_rosbags
def test_poses_may_come_from_a_topic_and_the_camera_from_a_file(tmp_path):
    path = write_bag(tmp_path / "a", poses="topic", info=False)
    with pytest.raises(UsageError, match=r"has no camera_info beside /eye/image_raw; give --camera FILE"):
        open_recording(path, ReaderOptions(image_topic=IMAGE, pose_topic=POSE))
    camera = write_camera(tmp_path / "K.json")
    check(open_recording(path, ReaderOptions(camera, image_topic=IMAGE, pose_topic=POSE)), depth=False)


@needs_rosbags
@pytest.mark.parametrize("encoding", ["BGR", "BGRA", "GRAY"])
def test_pictures_of_other_encodings(encoding, tmp_path):
    frame = next(iter(open_recording(write_bag(tmp_path / "a", encoding=encoding))))
    rgb = made_frames()[0].rgb
    np.testing.assert_array_equal(frame.image(), cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY) if encoding == "GRAY" else rgb)


@needs_rosbags
def test_the_lens_of_camera_info_is_known_by_its_name(tmp_path):
    path = write_bag(tmp_path / "a", lens=(0.1, 0.0, 0.0, 0.0), model="equidistant")
    assert open_recording(path).camera.lens == Lens((0.1, 0.0, 0.0, 0.0), "fisheye")
    with pytest.raises(UsageError, match=r"lens of kind 'omni'; known are plumb_bob, .*; give --camera FILE"):
        open_recording(write_bag(tmp_path / "b", model="omni"))


@needs_rosbags
def test_what_a_bag_lacks_is_one_sentence(tmp_path):
    path = write_bag(tmp_path / "a", poses="none")
    for options, message in (
        (ReaderOptions(), r"has no poses: there are no transforms \(tf\); give --pose-topic"),
        (ReaderOptions(pose_topic="/where"), r"no topic '/where'; choose --pose-topic of /eye/camera_info"),
        (ReaderOptions(pose_topic=DEPTH), r"/eye/depth has messages sensor_msgs/msg/Image; poses may be"),
        (ReaderOptions(image_topic="/left"), r"has no pictures '/left'; choose --image-topic of /eye/depth, /eye/imag"),
    ):
        with pytest.raises(UsageError, match=message):
            open_recording(path, options)
    with pytest.raises(UsageError, match=r"does not hang on 'map'; choose --base-frame of hand, base"):
        open_recording(write_bag(tmp_path / "b"), ReaderOptions(base_frame="map"))
    (tmp_path / "c.mcap").write_text("no bag")
    with pytest.raises(UsageError, match=r"c.mcap cannot be read as a bag"):
        open_recording(tmp_path / "c.mcap")


def test_without_rosbags_the_extra_is_named(tmp_path, monkeypatch):
    (tmp_path / "a.mcap").write_text("")
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(UsageError, match=r"pip install 'fixation-gym\[ros\]'"):
        open_recording(tmp_path / "a.mcap")


def test_a_chain_of_links_multiplies_poses_and_has_none_where_a_link_has_none():
    T_base_hand, T_hand_eye = (pose_to_matrix(frame.pose) for frame in made_frames()[:2])
    hand = Trajectory([0.0, PERIOD], [matrix_to_pose(T_base_hand)] * 2)
    links = {"eye": Link("hand", None, matrix_to_pose(T_hand_eye)), "hand": Link("base", hand)}
    chain = chain_to(links, "eye", None)
    np.testing.assert_allclose(pose_to_matrix(pose_along(chain, 0.5 * PERIOD)), T_base_hand @ T_hand_eye, atol=1e-12)
    assert pose_along(chain, 2 * PERIOD) is None
    np.testing.assert_allclose(pose_to_matrix(pose_along(chain_to(links, "eye", "hand"), 9.0)), T_hand_eye, atol=1e-12)
    with pytest.raises(UsageError, match="no transform says where 'nose' is; there are eye, hand"):
        chain_to(links, "nose", None)
