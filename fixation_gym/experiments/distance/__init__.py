"""The paper's Fig. 3b: error of the distance against distance."""
