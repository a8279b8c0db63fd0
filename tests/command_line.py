"""The commands, run in this process, and recordings and actor files that are wrong in one place."""

import yaml
from puppet import PUPPET
from small_recording import make_recording

from sogjax.cli.main import main
from sogjax.run import forward

INITIAL_POSE = "pose: rest\nposition: [0.0, 0.0, 1.0]\nheading: 0.0\n"


def trackable(folder, **changes):
    """A recording that can be opened and has a rough pose; nobody is in its pictures."""
    folder = make_recording(folder, **changes)
    (folder / "initial_pose.yaml").write_text(INITIAL_POSE)
    return folder


def actor_file(path, change=lambda content: None):
    """An actor with few joints, or its file with a change made to it."""
    content = yaml.safe_load(PUPPET)
    change(content)
    path.write_text(yaml.safe_dump(content))
    return path


def interrupt_at(monkeypatch, frame):
    """Ctrl-C reaches the main thread, where the tracker's step runs, after the frame at that place."""
    whole = forward.frames_done

    def frames_done(*arguments, **named):
        for done in whole(*arguments, **named):
            if done.tracked.index == frame:
                raise KeyboardInterrupt
            yield done

    monkeypatch.setattr(forward, "frames_done", frames_done)


def refused(capsys, *arguments):
    """The sentence with which a command line is refused: one line, exit status 2, nothing on standard output."""
    status = main([str(argument) for argument in arguments])
    out, err = capsys.readouterr()
    assert status == 2
    assert out == ""
    lines = err.splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("sogjax: ")
    assert "Traceback" not in err
    return lines[0]


def done(capsys, *arguments):
    """What a command line that does its work prints on standard output and standard error."""
    status = main([str(argument) for argument in arguments])
    out, err = capsys.readouterr()
    assert status == 0, err
    return out, err
