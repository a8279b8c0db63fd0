"""What to do about a verdict, in sentences."""

from sogjax.quality.verdict import Verdict

WRONG = {
    "not the subject": "Use the actor of the person who is seen, in the clothes that are worn (actor=, or leave it "
    "out, and it is made of the videos); look whether red and blue are exchanged in the pictures, and with `sogjax "
    "check` whether videos are under the names of other cameras.",
    "not where somebody": "Look at the first frame: if the skeleton does not stand on the person there, write a rough "
    "pose into initial_pose.yaml or begin elsewhere (start=); then run `sogjax check` for the calibration. If it does, "
    "and somebody is beside it who has no actor, give that one, too (actors=, actor=).",
    "inside each other": "Two actors were found on one person: give the actors of those who are there, or begin where "
    "they stand apart (start=).",
}
LOOK = {
    "overlaps to": "A camera that overlaps less than the others was touched, shows much that is in front of the actor, "
    "or has another tint: `sogjax check` says which; cameras=[...] leaves it out, `sogjax adjust ... cameras=true` "
    "moves it back.",
    "silhouettes overlap": "Silhouettes overlap too little everywhere: if somebody is seen beside the actor who has "
    "none, give that one, too (actors=, actor=); else look at the actor's silhouettes below, and make the actor again "
    "with more or better example poses if it is too thick, too thin, too long or too short.",
    "fits badly": "Look at the stretches in which the body fits badly; start= and stop= leave them out.",
    " jumps": "A limb that jumps is wrong on one side of the jump: the pictures of both frames show which. It may be "
    "exchanged with another, or behind somebody; more cameras on other sides tell it.",
    " through ": "Limbs are inside each other or the trunk: they were exchanged, or one is lost. More cameras or "
    "keypoints tell them apart; start= begins in a frame in which they are clear of each other.",
    "at its limit": "A joint at its limit is drawn to something dark or alike behind it: light from behind, another "
    "background, a cap or shoes of another colour.",
    "might as well": "A limb that might as well be elsewhere explains the pictures there, too: what it lies on has its "
    "colours. Cameras on other sides, keypoints, and sleeves unlike trunk and floor help.",
    "hidden by": "What is hidden is guessed. If nothing stands there, look at occluders.png: what is painted white in "
    "occluders/CAMERA.png hides all that is behind it.",
    "initial pose": "The initial pose was not sure: if its frame is wrong, write a rough one into initial_pose.yaml.",
}
"""What to do, by words of a finding: where nothing of a motion can be relied on, and where some can."""


def remedies(verdict: Verdict) -> tuple[str, ...]:
    """What to do, the first thing first; one sentence where nothing was found."""
    table = WRONG if verdict.wrong else LOOK
    found = [what for words, what in table.items() if any(words in each for each in verdict.findings)]
    if verdict.wrong:
        return tuple(found)
    if verdict.doubtful:
        names = ", ".join(dict.fromkeys(limb.name for limb in verdict.doubtful))
        found.insert(
            0,
            f"Look at the pictures of these stretches: if the skeleton leaves the {names}, more cameras on other "
            "sides, pictures of the empty scene (background/CAMERA.jpg) and clothes that differ from the room help; "
            "if it only came too late in a fast move, a higher frame rate does.",
        )
    return tuple(found) or ("Nothing. Look at a few frames below all the same, then go on to the next steps.",)
