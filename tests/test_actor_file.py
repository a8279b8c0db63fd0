"""Body files: what is written loads the same; what is wrong is named with key, value and expectation."""

import copy
import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import yaml
from body_cases import random_body, shipped

from sogjax.errors import InputError
from sogjax.io.actor_file import load_body, named_body, save_body
from sogjax.io.yaml_entry import MAX_BYTES
from sogjax.model.color import COLOR_RADIUS, from_rgb

SMALL = {
    "name": "rod",
    "unit": "m",
    "joints": [
        {"name": "turn", "parent": "slide", "offset": [0, 0, 1], "axis": [0, 3, 4], "kind": "revolute"},
        {"name": "slide", "parent": "world", "offset": [0.5, 0, 0], "axis": "-y", "kind": "prismatic"},
    ],
    "dofs": [
        {"name": "along", "limits": [-2, 3], "joints": {"slide": 1}},
        {"name": "both", "limits": "none", "joints": {"turn": -0.5, "slide": 0.25}},
        {"name": "around", "limits": [None, 1.5], "joints": {"turn": 1}},
    ],
    "blobs": [
        {"name": "low", "joint": "slide", "offset": [0, 0, 0.5], "sigma": 0.1, "color": [1, 0.5, 0]},
        {"name": "high", "joint": "turn", "offset": [0, 0.25, 0], "sigma": 0.2, "colour": [0, 0, 1]},
    ],
    "landmarks": [{"name": "tip", "joint": "turn", "offset": [0, 0, 0.75]}],
    "shape": [{"name": "length", "joint_offsets": ["turn"], "blob_offsets": ["low"], "blob_sigmas": ["low", "high"]}],
    "poses": {"rest": {}, "out": {"along": 0.5, "around": 1}},
}


def write(folder, content):
    path = folder / "body.yaml"
    path.write_text(content if isinstance(content, str) else yaml.safe_dump(content, sort_keys=False))
    return path


def assert_same(one, other, colors=0.0):
    assert jax.tree.structure(one) == jax.tree.structure(other)  # names, parents, groups
    np.testing.assert_allclose(one.blob_colors, other.blob_colors, atol=colors)
    for a, b in zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True):
        assert a.dtype == b.dtype
        if a is not one.blob_colors:
            np.testing.assert_array_equal(a, b)


def test_a_small_file_by_hand(tmp_path):
    body = load_body(write(tmp_path, SMALL))
    skeleton = body.skeleton
    assert (body.name, skeleton.names, skeleton.parents) == ("rod", ("slide", "turn"), (-1, 0))
    assert skeleton.dof_names == ("along", "both", "around")
    np.testing.assert_array_equal(skeleton.offsets, [[0.5, 0, 0], [0, 0, 1]])
    np.testing.assert_allclose(skeleton.axes, [[0, -1, 0], [0, 0.6, 0.8]], rtol=1e-7)
    np.testing.assert_array_equal(skeleton.revolute, [False, True])
    np.testing.assert_array_equal(skeleton.parameter_transform, [[1, 0.25, 0], [0, -0.5, 1]])
    np.testing.assert_array_equal(skeleton.dof_lower, [-2, -np.inf, -np.inf])
    np.testing.assert_array_equal(skeleton.dof_upper, [3, np.inf, 1.5])
    assert (body.blobs.names, body.blobs.joints) == (("low", "high"), (0, 1))
    np.testing.assert_allclose(body.blob_sigmas, [0.1, 0.2], rtol=1e-7)
    np.testing.assert_array_equal(body.blob_colors, [[1, 0.5, 0], [0, 0, 1]])
    np.testing.assert_array_equal(body.landmarks.offsets, [[0, 0, 0.75]])
    np.testing.assert_array_equal(body.poses["out"], [0.5, 0, 1])
    assert body.shape_groups[0].blob_sigmas == ("low", "high")
    assert all(leaf.dtype in (jnp.float32, jnp.bool_) for leaf in jax.tree.leaves(body))


def test_millimetres_move_alike(tmp_path):
    """A file in mm describes the same motion: lengths in mm, angles in radians, also where one DoF does both."""
    in_mm = copy.deepcopy(SMALL) | {"unit": "mm"}
    for row in (*in_mm["joints"], *in_mm["blobs"], *in_mm["landmarks"]):
        row["offset"] = [1000 * x for x in row["offset"]]
    for row in in_mm["blobs"]:
        row["sigma"] *= 1000
    in_mm["dofs"][0]["limits"] = [-2000, 3000]
    in_mm["dofs"][1]["joints"]["slide"] = 250
    in_mm["poses"]["out"]["along"] = 500
    one, other = load_body(write(tmp_path, SMALL)), load_body(write(tmp_path, in_mm))
    for a, b in zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-6)


@pytest.mark.parametrize("space", sorted(COLOR_RADIUS))
def test_colors_may_stand_in_any_space(tmp_path, space):
    rgb = jnp.array([0.75, 0.5, 0.25])
    content = copy.deepcopy(SMALL) | {"color_space": space}
    for row in content["blobs"]:
        row.pop("colour", None)
        row["color"] = [float(c) for c in from_rgb(rgb, space)]
    np.testing.assert_allclose(load_body(write(tmp_path, content)).blob_colors, [rgb, rgb], atol=2e-5)


def test_optional_parts_may_be_left_out(tmp_path):
    content = {key: SMALL[key] for key in ("name", "joints", "dofs", "blobs", "poses")}
    body = load_body(write(tmp_path, content))
    assert body.landmarks.names == ()
    assert body.landmarks.offsets.shape == (0, 3)
    assert body.shape_groups == ()
    save_body(tmp_path / "again.yaml", body)
    assert_same(load_body(tmp_path / "again.yaml"), body)


@pytest.mark.parametrize("seed", range(3))
def test_a_saved_random_body_loads_the_same(tmp_path, seed):
    body = random_body(seed, name="Bob: the 2nd, ä")
    assert (np.abs(np.asarray(body.skeleton.parameter_transform)).max(axis=0) > 0).all()
    save_body(tmp_path / "body.yaml", body)
    assert_same(load_body(tmp_path / "body.yaml"), body, colors=1e-4)


def test_a_saved_shipped_body_loads_the_same_and_is_readable(tmp_path):
    human = shipped("human")
    save_body(tmp_path / "human.yaml", human)
    assert_same(load_body(tmp_path / "human.yaml"), human, colors=1e-4)
    lines = (tmp_path / "human.yaml").read_text().splitlines()
    assert "  - {name: left_knee, parent: left_hip_twist, offset: [0, 0, -0.43], axis: y, kind: revolute}" in lines


def test_double_precision_is_respected(tmp_path):
    with jax.enable_x64(True):
        body = load_body(write(tmp_path, SMALL))
        assert body.skeleton.axes.dtype == jnp.float64
        assert float(body.skeleton.axes[1, 1]) == 0.6
        save_body(tmp_path / "again.yaml", body)
        assert_same(load_body(tmp_path / "again.yaml"), body)


def test_a_body_that_is_not_finite_is_not_written(tmp_path):
    body = random_body(0)
    leaves, tree = jax.tree.flatten(body)
    broken = jax.tree.unflatten(tree, [x * jnp.nan if x is body.blob_sigmas else x for x in leaves])
    with pytest.raises(ValueError, match="nan"):
        save_body(tmp_path / "body.yaml", broken)
    assert list(tmp_path.iterdir()) == []


def test_a_long_chain_listed_backwards_loads(tmp_path):
    count = 1200
    joints = [
        {"name": f"j{k}", "parent": f"j{k - 1}" if k else "world", "offset": [0, 0, 1], "axis": "x", "kind": "revolute"}
        for k in reversed(range(count))
    ]
    content = {"name": "chain", "joints": joints}
    content["dofs"] = [{"name": "bend", "joints": {"j3": 1}}]
    content["blobs"] = [{"name": "b", "joint": "j0", "offset": [0, 0, 0], "sigma": 1, "color": [0, 0, 0]}]
    content["poses"] = {"rest": {}}
    body = load_body(write(tmp_path, content))
    assert body.skeleton.names == tuple(f"j{k}" for k in range(count))


DELETE = object()
WRONG = {
    "unknown parent": (("joints", 0, "parent"), "slid", r"joints\[0\].parent is 'slid', .*slide"),
    "own parent": (("joints", 0, "parent"), "turn", r"joints\[0\].parent is 'turn', .*cycle"),
    "cycle": (("joints", 1, "parent"), "turn", r"joints\[[01]\].parent is .*cycle"),
    "bad kind": (("joints", 0, "kind"), "hinge", r"joints\[0\].kind is 'hinge', .*revolute"),
    "duplicate joint": (("joints", 0, "name"), "slide", r"joints\[1\].name is 'slide', "),
    "slash": (("joints", 0, "name"), "a/b", r"joints\[0\].name is 'a/b', "),
    "zero axis": (("joints", 0, "axis"), [0, 0, 0], r"joints\[0\].axis is \[0, 0, 0\], "),
    "axis letter": (("joints", 0, "axis"), "w", r"joints\[0\].axis is 'w', "),
    "two numbers": (("joints", 0, "offset"), [0, 1], r"joints\[0\].offset is \[0, 1\], .*three"),
    "text in offset": (("joints", 0, "offset", 2), "far", r"joints\[0\].offset\[2\] is 'far', .*number"),
    "nan": (("joints", 0, "offset", 2), float("nan"), r"joints\[0\].offset\[2\] is nan, .*finite"),
    "inf": (("blobs", 1, "offset", 0), float("-inf"), r"blobs\[1\].offset\[0\] is -inf, .*finite"),
    "over float32": (("blobs", 1, "offset", 0), 1e39, r"blobs\[1\].offset\[0\] is 1e\+39, .*finite"),
    "true": (("blobs", 1, "offset", 0), True, r"blobs\[1\].offset\[0\] is True, .*number"),
    "no joints": (("joints",), [], r"joints is \[\], .*row"),
    "joints no list": (("joints",), {"a": 1}, r"joints is a mapping, .*list"),
    "row no mapping": (("joints", 0), "turn", r"joints\[0\] is 'turn', .*mapping"),
    "missing key": (("joints", 0, "kind"), DELETE, r"joints\[0\] lacks the key `kind`"),
    "unknown key": (("blobs", 0, "sigmas"), 1, r"blobs\[0\].sigmas is unknown \(did you mean 'sigma'"),
    "missing table": (("blobs",), DELETE, r"the file lacks the key `blobs`"),
    "unknown table": (("bones",), [], r"the key bones is unknown"),
    "weight of unknown joint": (("dofs", 0, "joints", "slime"), 1, r"dofs\[0\].joints.slime is 'slime', .*joint"),
    "weight zero": (("dofs", 0, "joints", "slide"), 0, r"dofs\[0\].joints.slide is 0, .*other than 0"),
    "weight text": (("dofs", 0, "joints", "slide"), "much", r"dofs\[0\].joints.slide is 'much', .*number"),
    "no weights": (("dofs", 0, "joints"), {}, r"dofs\[0\].joints is a mapping, .*at least one"),
    "limits swapped": (("dofs", 0, "limits"), [3, -2], r"dofs\[0\].limits is \[3, -2\], .*lower limit before"),
    "one limit": (("dofs", 0, "limits"), [3], r"dofs\[0\].limits is \[3\], .*lower, upper"),
    "limit nan": (("dofs", 0, "limits", 0), float("nan"), r"dofs\[0\].limits\[0\] is nan, .*finite"),
    "zero sigma": (("blobs", 1, "sigma"), 0, r"blobs\[1\].sigma is 0, .*over 0"),
    "negative sigma": (("blobs", 1, "sigma"), -0.1, r"blobs\[1\].sigma is -0.1, .*over 0"),
    "blob's joint": (("blobs", 1, "joint"), "elbow", r"blobs\[1\].joint is 'elbow', .*name of a joint"),
    "landmark's joint": (("landmarks", 0, "joint"), 3, r"landmarks\[0\].joint is 3, .*name of a joint"),
    "colour of 255": (("blobs", 0, "color"), [255, 0, 0], r"blobs\[0\].color is \[255, 0, 0\], .*0 to 1"),
    "two colours": (("blobs", 0, "colour"), [0, 0, 0], r"blobs\[0\] needs one key `color`"),
    "no colour": (("blobs", 0, "color"), DELETE, r"blobs\[0\] needs one key `color`"),
    "colour space": (("color_space",), "cmyk", r"color_space is 'cmyk', .*rgb"),
    "unit": (("unit",), "cm", r"unit is 'cm', .*m, mm"),
    "name": (("name",), 7, r"name is 7, .*text"),
    "name with slash": (("name",), "../rod", r"name is '../rod', "),
    "no rest pose": (("poses", "rest"), DELETE, r"poses lacks the key `rest`"),
    "pose of unknown dof": (("poses", "out", "arround"), 1, r"poses.out.arround is 'arround', .*around"),
    "pose value": (("poses", "out", "along"), None, r"poses.out.along is empty, .*number"),
    "pose no mapping": (("poses", "out"), [1, 2, 3], r"poses.out is \[1, 2, 3\], .*mapping"),
    "shape of unknown joint": (("shape", 0, "joint_offsets", 0), "trun", r"joint_offsets\[0\] is 'trun', .*turn"),
    "shape of unknown blob": (("shape", 0, "blob_offsets", 0), "lo", r"blob_offsets\[0\] is 'lo', .*low"),
    "shape twice": (("shape", 0, "blob_offsets"), ["low", "low"], r"shape\[0\].blob_offsets is .*every name once"),
    "shape unknown list": (("shape", 0, "sigmas"), ["low"], r"shape\[0\].sigmas is unknown"),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_value_is_named(tmp_path, case):
    place, value, expected = WRONG[case]
    content = copy.deepcopy(SMALL)
    part = content
    for key in place[:-1]:
        part = part[key]
    if value is DELETE:
        del part[place[-1]]
    else:
        part[place[-1]] = value
    path = write(tmp_path, content)
    with pytest.raises(InputError, match=expected) as error:
        load_body(path)
    message = str(error.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    assert len(message) < len(str(path)) + 300


TEXT = yaml.safe_dump(SMALL, sort_keys=False)
BROKEN = {
    "not YAML": ("name: [rod\njoints: }", "valid YAML in line 2"),
    "a list": ("- a\n- b\n", "the content is .*, expected a mapping"),
    "a text": ("hello", "the content is 'hello', expected a mapping"),
    "empty": ("", "the content is empty"),
    "number as key": ("1: 2\n", "names as keys"),
    "key twice": (TEXT + "name: other\n", "'name' occurs twice"),
    "alias": ("a: &a [1]\nb: *a\n", "aliases"),
    "a few aliases for gigabytes": ("a: &a [x,x,x]\nb: &b [*a,*a,*a]\nc: [*b,*b,*b]\n", "aliases"),
    "python object": ("name: !!python/object/apply:os.system ['true']\n", "valid YAML"),
    "too large": ("#" * (MAX_BYTES + 1), "larger than"),
    "too deep": ("[" * 50_000, "nested too deeply"),
    "many digits": (TEXT.replace("name: rod", "name: 0x" + "f" * 9000), "name is a number with very many digits"),
    "control characters": ("name: \x01\n", "valid YAML"),
    "bad date": ("name: 2001-99-99\n", "valid YAML"),
    "list as map": ("name: !!map [1]\n", "valid YAML"),
    "mapping as key": ("? {a: 1}\n: 2\n", "valid YAML"),
}  # fmt: skip


@pytest.mark.parametrize("case", BROKEN)
def test_a_broken_file_gives_one_sentence(tmp_path, case):
    content, expected = BROKEN[case]
    path = write(tmp_path, content)
    with pytest.raises(InputError, match=expected) as error:
        load_body(path)
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


def test_bytes_that_are_no_text(tmp_path):
    path = tmp_path / "body.yaml"
    path.write_bytes(b"name: \xff\xfe\x00")
    with pytest.raises(InputError, match="valid YAML"):
        load_body(path)


@pytest.mark.parametrize("name", ["nothing.yaml", ""])
def test_a_file_that_cannot_be_read(tmp_path, name):
    with pytest.raises(InputError, match="cannot be read"):
        load_body(tmp_path / name)


def test_exponents_without_a_point_are_numbers(tmp_path):
    """YAML 1.1 takes 1e-1 for text; people take it for a number."""
    text = re.sub(r"sigma: 0.1\b", "sigma: 1e-1", TEXT)
    np.testing.assert_allclose(load_body(write(tmp_path, text)).blob_sigmas, [0.1, 0.2], rtol=1e-6)


def test_named_bodies():
    assert named_body("human").is_file()
    with pytest.raises(InputError, match=r"cat: .* dog, human"):
        named_body("cat")
