"""`sogjax actor`: an actor file from the example poses of a recording."""

from pathlib import Path

from sogjax.actor.make import make_actor
from sogjax.app.build import color_space_and_radius, energy_weights
from sogjax.app.configs import ActorConfig
from sogjax.app.outputs import prepare_folder
from sogjax.app.recordings import body_named, opened, say
from sogjax.data.actor_file import save_body


def run(config: ActorConfig) -> Path:
    """Make the actor and write its file.

    Raises:
        InputError: anything wrong with the recording, its example poses or the body.
    """
    recording = opened(config.recording, config.cameras)
    out = Path(config.out)
    prepare_folder(out.parent)
    space, _ = color_space_and_radius(config.color)
    made = make_actor(
        recording, body_named(config.body), config.subject, space, energy_weights(config.energy), report=say
    )
    save_body(out, made.body)
    print(out)
    return out
