"""Random changes of images: what they may change, and what they leave."""

import pytest
import torch

from fixation_policies.rl.augmentation import jittered, shifted
from fixation_policies.rl.config import CONFIGS
from fixation_policies.rl.features import JoinedFeatures
from fixation_policies.rl.inputs import input_space

pytestmark = pytest.mark.filterwarnings("error")


@pytest.fixture(autouse=True)
def seeded():
    torch.manual_seed(0)


def test_each_image_is_moved_as_a_whole_by_four_pixels_at_most():
    rows, columns = torch.meshgrid(torch.arange(20.0), torch.arange(16.0), indexing="ij")
    moved = shifted(torch.stack([rows, columns]).expand(200, 2, 20, 16).contiguous())
    steps = torch.stack([moved[:, 0, 10, 8] - 10.0, moved[:, 1, 10, 8] - 8.0])
    assert set(steps.unique().tolist()) == set(range(-4, 5))
    # Away from the border all pixels have moved by the same; beyond it the border is repeated.
    inside = moved[:, :, 4:-4, 4:-4] - torch.stack([rows, columns])[:, 4:-4, 4:-4]
    assert torch.equal(inside, steps.T[:, :, None, None].expand_as(inside))
    assert moved[:, 0].min() == 0.0
    assert moved[:, 0].max() == 19.0


def test_grey_stays_grey_and_all_images_of_a_stack_change_alike():
    grey = torch.linspace(0.3, 0.6, 25).reshape(1, 1, 5, 5).expand(50, 9, 5, 5).contiguous()
    changed = jittered(grey)
    assert torch.allclose(changed[:, 0:1].expand_as(changed), changed, atol=1e-5)
    colours = torch.rand(50, 3, 5, 5).repeat(1, 3, 1, 1)
    changed = jittered(colours)
    assert torch.equal(changed[:, :3], changed[:, 3:6])
    assert torch.equal(changed[:, :3], changed[:, 6:])


def test_brightness_contrast_and_hue_change_as_far_as_they_may():
    grey = torch.full((4000, 3, 2, 2), 0.5)
    levels = jittered(grey)[:, 0, 0, 0]
    assert 0.349 < levels.min() < 0.37
    assert 0.63 < levels.max() < 0.651
    red = torch.tensor([0.6, 0.2, 0.2])[None, :, None, None].expand(4000, 3, 2, 2).contiguous()
    red, green, blue = jittered(red)[:, :, 0, 0].T
    assert 0.4 < (red > torch.maximum(green, blue)).float().mean() < 0.6  # within 60 of 108 degrees
    assert (green > red).any()  # a third of a full turn is nearly green
    assert (blue > red).any()
    assert jittered(torch.rand(100, 3, 4, 4)).min() >= 0.0


def test_only_a_network_that_learns_sees_changed_images():
    learner = CONFIGS["rgb_augmented"]
    space = input_space(learner)
    network = JoinedFeatures(space, learner.convolutions, learner.augmented)
    view = torch.rand(4, *space["view"].shape)
    inputs = {"vector": torch.zeros(4, *space["vector"].shape), "view": view}
    network.eval()
    assert torch.equal(network(inputs), network(inputs))
    network.train()
    assert not torch.equal(network(inputs), network(inputs))
    assert network(inputs).shape == (4, network.features_dim)
    plain = JoinedFeatures(input_space(CONFIGS["rgb"]))
    small = {"vector": inputs["vector"], "view": torch.rand(4, 6, 48, 48)}
    plain.train()
    assert torch.equal(plain(small), plain(small))
