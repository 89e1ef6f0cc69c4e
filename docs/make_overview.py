"""Draw the README's picture from data that is computed here: ``python docs/make_overview.py``."""

from pathlib import Path

import numpy as np
from PIL import Image

from unconstrain.paper.experiments import toy
from unconstrain.paper.figures.overview import overview

settings = toy.ToySettings()
demonstrations = toy.demonstrate(settings, np.random.default_rng(2), toy.random_lines)
learners = toy.learners(settings)
learnt = toy.policy(settings).fit_demonstrations(demonstrations)

path = Path(__file__).parent / "_static" / "overview.png"
overview(
    path,
    demonstrations,
    settings.system,
    {
        "Learnt directly": learnt.with_learner(learners["direct"]),
        "Learnt consistently": learnt.with_learner(learners["hybrid"]),
    },
)

Image.open(path).convert("RGB").quantize(160).save(path, optimize=True)
