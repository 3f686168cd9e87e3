"""Made-up recordings with exact truth: a red square before a wall, a post in front of both, a camera that circles."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import cv2
import numpy as np
from pinhole_scene import UP, Scene, fixating_pose, noise_texture, upright
from scipy.spatial.transform import Rotation

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import look_at, matrix_to_pose

CAMERA = Intrinsics(160, 120, 150.0, 152.0, 81.0, 58.0)
TARGET = np.array([0.6, 0.0, 0.2])
PERIOD = 1.0 / 16.0  # s; binary, so that times add up exactly
COUNT = 24


@dataclass(frozen=True)
class Made:
    """One exact frame."""

    time: float
    pose: np.ndarray
    rgb: np.ndarray
    depth: np.ndarray
    mask: np.ndarray
    distance: float


def scene() -> Scene:
    return Scene(
        [
            upright([1.0, 0.0, 0.2], 1.5, 1.2, noise_texture(1)),
            upright(TARGET, 0.06, 0.06, noise_texture(2, (1.0, 0.15, 0.1), 0.2)),
            upright([0.35, 0.08, 0.2], 0.02, 0.07, noise_texture(3)),
        ]
    )


def made_frame(time: float, T: np.ndarray, seed: int) -> Made:
    rgb, depth, index = scene().render(T, CAMERA, noise=1.0, seed=seed)
    return Made(time, matrix_to_pose(T), rgb, depth, index == 1, float(T[:3, 2] @ (TARGET - T[:3, 3])))


@cache
def made_frames() -> tuple[Made, ...]:
    frames = []
    for step in range(COUNT):
        angle = 2.0 * np.pi * step / COUNT
        T = fixating_pose([0.0, 0.08 * np.sin(angle), 0.22 + 0.05 * np.cos(angle)], TARGET)
        frames.append(made_frame(step * PERIOD, T, step))
    return tuple(frames)


HAND_PERIOD = 1.0 / 32.0
"""Of the pictures of a camera in a hand, s."""


def hand_pose(time: float) -> np.ndarray:
    """A camera that is moved to and fro by a hand, with a gaze that wanders and sways."""
    place = [0.03 * np.sin(3.1 * time), 0.09 * np.sin(2.3 * time), 0.22 + 0.06 * np.sin(3.7 * time + 1.0)]
    aim = TARGET + np.array([0.0, 0.06 * np.sin(4.3 * time + 0.5), 0.05 * np.sin(5.1 * time)])
    T = look_at(np.array(place), aim, UP).copy()
    T[:3, :3] = T[:3, :3] @ Rotation.from_rotvec([0.0, 0.0, 0.15 * np.sin(2.9 * time)]).as_matrix()
    return T


@cache
def hand_frames() -> tuple[Made, ...]:
    """Two seconds of a camera in a hand."""
    return tuple(made_frame(k * HAND_PERIOD, hand_pose(k * HAND_PERIOD), k) for k in range(64))


def bounding_box(mask) -> list[int]:
    return list(cv2.boundingRect(mask.astype(np.uint8)))


def write_picture(path: Path, image) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), image[..., ::-1] if image.ndim == 3 else image)


def millimetres(depth, unit=1e-3):
    return np.where(np.isfinite(depth), np.rint(depth / unit), 0).astype(np.uint16)


def write_camera(path: Path, camera: Intrinsics = CAMERA, **more) -> Path:
    keys = ("width", "height", "fx", "fy", "cx", "cy")
    path.write_text(json.dumps({**{key: getattr(camera, key) for key in keys}, "distortion": [0.0] * 5, **more}))
    return path


COLUMNS = ["time_s", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "rgb", "depth", "mask", "distance_true_m"]


def layout_rows(frames, truth=True) -> list[list[str]]:
    rows = []
    for k, frame in enumerate(frames):
        files = [f"rgb/{k}.png", f"depth/{k}.png", f"mask/{k}.png"] if truth else [f"rgb/{k}.png", "", ""]
        numbers = [repr(float(value)) for value in (frame.time, *frame.pose)]
        rows.append([*numbers, *files, repr(frame.distance) if truth else ""])
    return rows


def write_rows(folder: Path, rows, columns=COLUMNS) -> None:
    (folder / "frames.csv").write_text("\n".join(",".join(row) for row in [columns, *rows]) + "\n")


def write_layout(folder: Path, frames=None, truth=True, rows=None, box=True) -> Path:
    frames = made_frames() if frames is None else frames
    folder.mkdir(parents=True)
    write_camera(folder / "camera.json", source="made up")
    for k, frame in enumerate(frames):
        write_picture(folder / f"rgb/{k}.png", frame.rgb)
        if truth:
            write_picture(folder / f"depth/{k}.png", millimetres(frame.depth))
            write_picture(folder / f"mask/{k}.png", 255 * frame.mask.astype(np.uint8))
    write_rows(folder, layout_rows(frames, truth) if rows is None else rows)
    if box:
        (folder / "target.json").write_text(json.dumps({"first_frame_box_xywh": bounding_box(frames[0].mask)}))
    return folder


def write_tum(folder: Path, frames=None) -> Path:
    """Poses at other times than the pictures', four for each; depths 5 ms late."""
    frames = made_frames() if frames is None else frames
    rgb, depth, poses = (["# a comment"] for _ in range(3))
    for k, frame in enumerate(frames):
        write_picture(folder / f"rgb/{k}.png", frame.rgb)
        write_picture(folder / f"depth/{k}.png", millimetres(frame.depth, 1 / 5000))
        rgb.append(f"{frame.time:.6f} rgb/{k}.png")
        depth.append(f"{frame.time + 0.005:.6f} depth/{k}.png")
    for step in range(4 * (len(frames) - 1) + 1):
        angle = 2.0 * np.pi * step / 4 / COUNT
        T = fixating_pose([0.0, 0.08 * np.sin(angle), 0.22 + 0.05 * np.cos(angle)], TARGET)
        x, y, z, qw, qx, qy, qz = matrix_to_pose(T)
        poses.append(" ".join(f"{value:.7f}" for value in (step * PERIOD / 4, x, y, z, qx, qy, qz, qw)))
    for name, lines in (("rgb", rgb), ("depth", depth), ("groundtruth", poses)):
        (folder / f"{name}.txt").write_text("\n".join(lines) + "\n")
    return folder


def write_seven_scenes(folder: Path, frames=None) -> Path:
    from fixation_gym.geometry.rigid import pose_to_matrix

    for k, frame in enumerate(made_frames() if frames is None else frames):
        write_picture(folder / f"frame-{k:06d}.color.png", frame.rgb)
        depth = millimetres(frame.depth)
        write_picture(folder / f"frame-{k:06d}.depth.png", np.where(depth == 0, np.uint16(65535), depth))
        np.savetxt(folder / f"frame-{k:06d}.pose.txt", pose_to_matrix(frame.pose))
    return folder


def write_video(path: Path, frames=None) -> Path:
    """Without loss, at the frames' own times."""
    path.parent.mkdir(parents=True, exist_ok=True)
    film = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"FFV1"), 1.0 / PERIOD, (CAMERA.width, CAMERA.height))
    assert film.isOpened()
    for frame in made_frames() if frames is None else frames:
        film.write(np.ascontiguousarray(frame.rgb[..., ::-1]))
    film.release()
    return path


def write_npz(path: Path, frames=None) -> Path:
    frames = made_frames() if frames is None else frames
    np.savez(
        path,
        time=np.array([[frame.time] for frame in frames], np.float32),
        rgb=np.stack([frame.rgb for frame in frames]),
        camera_pose=np.stack([frame.pose for frame in frames]).astype(np.float32),
        joint_pos=np.zeros((len(frames), 7), np.float32),
        target_box=np.array([bounding_box(frames[0].mask)] * len(frames), np.float32),
    )
    return path
