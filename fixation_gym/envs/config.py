"""What can be chosen about an environment: scenarios, sensor noise, limits. Plain frozen values, all JSON-able."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from fixation_gym.envs.field_checks import require_names, require_number, require_range, require_shape, with_fields
from fixation_gym.envs.object_pool import MAX_OBSTACLES, TARGET_SHAPES
from fixation_gym.envs.obstacle_kinds import KIND_NAMES
from fixation_gym.envs.shapes import MATERIALS, PLAIN_MATERIALS
from fixation_gym.robots import ROBOT

CONTROL_FREQUENCY = 25
"""Control steps per second."""
EPISODE_SECONDS = 25.0
TASK = "pick up the object in the box of the first picture"
"""What the robot is to do, for policies that read."""
IMAGE_SIZE = (240, 320)
"""Default (height, width) of the wrist image, px."""
LIFT_HEIGHT = 0.10
"""Rise of the target above its resting height that counts as lifted, m."""
HOLD_SECONDS = 0.5
COLLISION_FORCE = 1.0
"""Robot-obstacle contact force above which a contact is a collision, N."""
COLLISION_PUSH = 0.01
"""Distance an obstacle may be pushed by the robot before it is a collision, m."""
TABLE_FORCE = 5.0
"""Robot-table contact force above which a contact is a collision, N."""

OBSTACLE_MOTIONS = ("driven", "pushed")
"""What a moving obstacle may do: go to and fro at constant speed, or be pushed to another place once."""
LOOKS = ("usual", "tinted", "coloured", "plain")
"""How obstacles or the room may look: as usual; in pale colours; in strong ones with drawn textures; without texture.
No drawn colour is the target's red."""


@dataclass(frozen=True)
class Scenario:
    """Recipe from which scenes are sampled."""

    name: str = "custom"
    obstacle_materials: tuple[str, ...] = ()
    """Materials to draw from, ``shapes.MATERIALS``; the first obstacle is of the first one."""
    obstacle_kinds: tuple[str, ...] = KIND_NAMES
    """Kinds to draw from, ``obstacle_kinds.KIND_NAMES``."""
    first_kinds: tuple[str, ...] = ()
    """Kinds of the first obstacle; none: any of ``obstacle_kinds``."""
    obstacle_count: tuple[int, int] = (0, 0)
    """Smallest and largest number of obstacles that stand still, inclusive."""
    free_elevation_deg: tuple[float, float] = ROBOT.arm.reach.elevations_deg
    """Range of the elevation of the way that is left free, deg."""
    free_azimuth_shape: tuple[float, float] = (0.75, 0.6)
    """Both exponents of the beta distribution from which its azimuth is drawn over the reach; (1, 1) is even. Fewer
    scenes are found for a way in the middle, which has ways on all sides that it takes along, than for one at an end:
    the shape is to make up for that, so that all ways are free about equally often."""
    most_open: float = 0.36
    """Largest share of the ways among which the free one is drawn that obstacles need not bar."""
    moving_count: tuple[int, int] = (0, 0)
    """Smallest and largest number of obstacles that move, inclusive."""
    alpha: tuple[float, float] = (0.3, 0.7)
    """Range of the opacity of see-through obstacles."""
    target_shapes: tuple[str, ...] = tuple(shape.name for shape in TARGET_SHAPES)
    grasp_width: tuple[float, float] = ROBOT.hand.grasp_widths
    """Range of the target's width between the fingers, m."""
    view_elevation_deg: tuple[float, float] = (40.0, 60.0)
    """Range of the angle by which the camera first looks down at the target, deg."""
    through_sight: bool = False
    """Whether the first line of sight to the target's centre passes through the first obstacle."""
    discovery: bool = False
    """Whether something stands in the natural way around the first obstacle and cannot be seen from the start."""
    obstacle_motions: tuple[str, ...] = OBSTACLE_MOTIONS
    """Motions to draw from, one of ``OBSTACLE_MOTIONS`` for each obstacle that moves."""
    drive_speed: tuple[float, float] = (0.03, 0.10)
    """Range of the speed of driven obstacles, m/s."""
    obstacle_push: tuple[float, float] = (0.04, 0.10)
    """Range of the displacement of pushed obstacles, m."""
    target_push: tuple[float, float] = (0.03, 0.08)
    """Range of the displacement of a pushed target, m."""
    push_time: tuple[float, float] = (2.0, 6.0)
    """Range of the time since reset at which a push begins, s."""
    target_moves: float = 0.0
    """Probability that the target is pushed."""
    distractor: float = 0.0
    """Probability of a second object of the target's colour, which stays in its place."""
    coloured_frames: bool = False
    """Whether frames and rims are of colours drawn for each obstacle, instead of one dark grey. Nothing else of a
    scene differs."""
    several_mirrors: bool = False
    """Whether there may be more than one framed mirror; MuJoCo shows the reflection in one of them only."""
    any_colour: bool = False
    """Whether target, distractor and obstacles are of any colour and texture; the box in the first image tells which
    thing is the target. Nothing else of a scene differs."""
    obstacle_looks: str = "usual"
    """Colours and textures of obstacles, one of ``LOOKS``. Nothing else of a scene differs."""
    room_looks: str = "usual"
    """The same of table, sheets, boards, floor and walls."""
    target_hue_deg: float = 0.0
    """Turn of the hue of target and distractor, to either side, deg; the box in the first image tells which thing is
    the target. Nothing else of a scene differs."""
    light_slant: float = 1.0
    """Factor on the horizontal part of the light's direction, which is at most 0.5 along x and y of what goes down."""

    def __post_init__(self) -> None:
        require_names("obstacle_materials", self.obstacle_materials, MATERIALS)
        require_names("obstacle_kinds", self.obstacle_kinds, KIND_NAMES)
        require_names("first_kinds", self.first_kinds, KIND_NAMES)
        require_names("target_shapes", self.target_shapes, tuple(shape.name for shape in TARGET_SHAPES))
        for name in ("obstacle_count", "moving_count"):
            require_range(name, getattr(self, name), 0, MAX_OBSTACLES)
            if not all(isinstance(count, int) for count in getattr(self, name)):
                raise ValueError(f"{name} must be two whole numbers, got {getattr(self, name)}")
        require_range("grasp_width", self.grasp_width, *ROBOT.hand.grasp_widths)
        require_range("alpha", self.alpha, 0.0, 1.0)
        require_range("free_elevation_deg", self.free_elevation_deg, *ROBOT.arm.reach.elevations_deg)
        require_shape("free_azimuth_shape", self.free_azimuth_shape)
        require_number("most_open", self.most_open, 0.2, 1.0)
        require_range("view_elevation_deg", self.view_elevation_deg, 30.0, 60.0)
        require_names("obstacle_motions", self.obstacle_motions, OBSTACLE_MOTIONS)
        require_range("drive_speed", self.drive_speed, 0.01, 0.10)
        require_range("obstacle_push", self.obstacle_push, 0.0, 0.10)
        require_range("target_push", self.target_push, 0.0, 0.08)
        require_range("push_time", self.push_time, 0.0, EPISODE_SECONDS)
        require_number("target_moves", self.target_moves, 0.0, 1.0)
        require_number("distractor", self.distractor, 0.0, 1.0)
        for name in ("through_sight", "discovery", "coloured_frames", "any_colour", "several_mirrors"):
            if not isinstance(getattr(self, name), bool):
                raise ValueError(f"{name} must be true or false, got {getattr(self, name)!r}")
        require_names("obstacle_looks", (self.obstacle_looks,), LOOKS)
        require_names("room_looks", (self.room_looks,), LOOKS)
        require_number("target_hue_deg", self.target_hue_deg, 0.0, 180.0)
        require_number("light_slant", self.light_slant, 0.0, 20.0)
        self._check_obstacles()

    @property
    def red_target(self) -> bool:
        """Whether the target has the usual colour; otherwise the box in the first image tells which thing it is."""
        return not (self.any_colour or self.target_hue_deg)

    @property
    def has_obstacles(self) -> bool:
        """Whether there may be any."""
        return self.obstacle_count[1] + self.moving_count[1] > 0

    @property
    def plain(self) -> bool:
        """Whether MuJoCo's pictures show it as it is; otherwise it is made for ``renderer="mitsuba"``."""
        return set(self.obstacle_materials) <= set(PLAIN_MATERIALS) and not self.several_mirrors

    def _check_obstacles(self) -> None:
        """Check that fields fit together."""
        if not self.target_shapes:
            raise ValueError("target_shapes must name at least one shape")
        still, moving = self.obstacle_count, self.moving_count
        if still[1] + moving[1] > MAX_OBSTACLES:
            raise ValueError(f"obstacle_count and moving_count may add up to {MAX_OBSTACLES}, got {still} and {moving}")
        if (self.through_sight or self.discovery) and still[0] < 1:
            raise ValueError("through_sight and discovery need an obstacle_count of 1 or more")
        if not self.has_obstacles:
            return
        if not self.obstacle_materials or not self.obstacle_kinds:
            raise ValueError(f"obstacle_count {still} needs obstacle_materials and obstacle_kinds to draw from")
        if moving[1] and not self.obstacle_motions:
            raise ValueError(f"moving_count {moving} needs obstacle_motions from {list(OBSTACLE_MOTIONS)}")
        alone = set(self.obstacle_materials) == {"mirror"} and (moving[1] > 0 or not self.several_mirrors)
        if alone and still[1] + moving[1] > 1:
            raise ValueError(
                "obstacle_materials of mirrors alone allow one obstacle; add another material, or several_mirrors"
            )


def _reached(low: float, high: float) -> tuple[float, float]:
    """What the arm reaches of a range of elevations, deg."""
    lowest, highest = ROBOT.arm.reach.elevations_deg
    return min(max(low, lowest), highest), max(min(high, highest), lowest)


_SCREEN = Scenario(
    "screen",
    ("translucent",),
    obstacle_kinds=("wall", "leaning_board", "roof", "niche"),
    obstacle_count=(2, 5),
)

SCENARIOS: dict[str, Scenario] = {
    scenario.name: scenario
    for scenario in (
        Scenario("clear"),
        Scenario("opaque", ("opaque",), obstacle_count=(2, 6)),
        Scenario("translucent", ("translucent",), obstacle_count=(2, 6)),
        Scenario("mirror", ("mirror", "opaque"), obstacle_count=(2, 6)),
        Scenario(
            "line_of_sight",
            ("translucent", "wire"),
            first_kinds=("thing", "wall", "leaning_board", "arch", "hanging", "roof", "shelf"),
            obstacle_count=(2, 6),
            through_sight=True,
        ),
        Scenario("moving_obstacle", ("opaque", "translucent"), obstacle_count=(2, 5), moving_count=(1, 2)),
        Scenario("moving_target", target_moves=1.0),
        Scenario("distractor", distractor=1.0),
        Scenario(
            "mixed",
            PLAIN_MATERIALS,
            obstacle_count=(2, 6),
            moving_count=(0, 1),
            target_moves=0.3,
            distractor=0.3,
        ),
        _SCREEN,
        replace(_SCREEN, name="screen_coloured", coloured_frames=True),
        Scenario(
            "shelf",
            ("opaque", "translucent", "wire"),
            first_kinds=("cabinet", "shelf", "roof"),
            obstacle_count=(2, 6),
            free_elevation_deg=_reached(40.0, 70.0),
        ),
        Scenario(
            "bin",
            ("opaque", "translucent", "wire"),
            first_kinds=("bin", "niche"),
            obstacle_count=(2, 6),
            free_elevation_deg=_reached(46.0, 85.0),
            free_azimuth_shape=(1.3, 1.1),
            most_open=0.32,
        ),
        Scenario("clutter", PLAIN_MATERIALS, obstacle_count=(5, 9)),
        Scenario(
            "any_colour", ("opaque", "translucent", "wire"), obstacle_count=(2, 6), distractor=0.5, any_colour=True
        ),
        Scenario(
            "discovery",
            ("mirror", "opaque"),
            first_kinds=("wall", "thing"),
            obstacle_count=(2, 6),
            discovery=True,
        ),
        Scenario("glass", ("glass",), first_kinds=("thing",), obstacle_count=(2, 6)),
        Scenario("chrome", ("chrome",), first_kinds=("thing",), obstacle_count=(2, 6)),
        Scenario("two_mirrors", ("mirror",), obstacle_count=(2, 6), several_mirrors=True),
        Scenario(
            "window",
            ("translucent", "glass"),
            first_kinds=("cabinet", "niche"),
            obstacle_count=(1, 5),
            free_elevation_deg=_reached(40.0, 70.0),
        ),
        Scenario(
            "photoreal_mixed",
            ("glass", "chrome", "lacquer", "plastic", "mirror", "opaque", "wire"),
            obstacle_count=(2, 6),
            moving_count=(0, 1),
            target_moves=0.3,
            distractor=0.3,
            several_mirrors=True,
        ),
    )
}
SCENARIO_NAMES = tuple(SCENARIOS)


def resolve_scenario(scenario: str | Mapping[str, Any] | Scenario) -> Scenario:
    """Scenario of that name, or one built from a mapping of ``Scenario`` fields.

    A mapping may hold ``base``, the name of the scenario whose values it changes.

    Raises:
        ValueError: for an unknown name or field; the message lists the valid ones.
    """
    if isinstance(scenario, Scenario):
        return scenario
    if isinstance(scenario, str):
        if scenario not in SCENARIOS:
            raise ValueError(f"unknown scenario {scenario!r}; choose one of {', '.join(SCENARIO_NAMES)}")
        return SCENARIOS[scenario]
    if not isinstance(scenario, Mapping):
        raise ValueError(f"scenario must be a name or a mapping, got {type(scenario).__name__}")
    values = dict(scenario)
    base = resolve_scenario(values.pop("base", "clear"))
    return with_fields(base, {"name": "custom", **values}, "scenario fields", "base")
