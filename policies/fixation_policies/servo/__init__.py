"""The paper's servo behaviour: fixate, know the distance, move around what is in the way, grasp."""
