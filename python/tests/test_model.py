import json
import math
import pickle
import warnings

import numpy as np
import pytest
import romc

from conftest import JUMPS, MODELS, ROOT


@pytest.fixture(scope="module")
def parts():
    """The arrays of a shipped model."""
    document = json.loads((MODELS / "go1-d6.json").read_text())
    map_of = lambda part: tuple(np.array(document[part][key]) for key in ("weights", "bias"))
    return {
        "encoder": map_of("encoder"),
        "decoder": map_of("decoder"),
        "xi": {phase["name"]: np.array(phase["xi"]) for phase in document["phases"]},
        "scaling": document["scaling"]["state"],
        "input_scaling": document["scaling"]["input"],
        "library": romc.Model.load(MODELS / "go1-d6.json").library,
        "robot": "go1",
        "wrench_frame": document["wrench_frame"],
        "actuators": document["actuators"],
    }


def theta_row(library, values):
    functions = {name: getattr(math, name) for name in ("sin", "cos", "tanh", "exp")}
    return [eval(term.replace("^", "**"), {**functions, **values}) for term in library]


def test_maps_and_accelerations_are_those_of_the_arrays(parts):
    model = romc.Model.from_arrays(**parts)
    rng = np.random.default_rng(5)
    x, dx, u = rng.normal(size=(3, 7, 18))
    (W, b), (D, c), s, s_u = (parts[key] for key in ("encoder", "decoder", "scaling", "input_scaling"))
    z, dz = model.encode(x), model.encode_velocity(dx)
    u_lat = model.project_input(u)
    np.testing.assert_allclose(z, (s * x) @ W.T + b, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(dz, (s * dx) @ W.T, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(u_lat, (s_u * u) @ np.linalg.pinv(W), rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(model.decode(z), (z @ D.T + c) / s, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(model.lift_input(u_lat), u_lat @ W / s_u, rtol=1e-12, atol=1e-12)
    for phase, xi in parts["xi"].items():
        for row in range(len(z)):
            kinds = {"z": z[row], "dz": dz[row], "u": u_lat[row]}
            values = {f"{kind}{i}": v for kind, row_ in kinds.items() for i, v in enumerate(row_, 1)}
            expected = np.array(theta_row(parts["library"], values)) @ xi
            found = model.acceleration(phase, z[row], dz[row], u_lat[row])
            np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-11)


def test_latent_words_have_quantity_and_unit(parts):
    words = romc.Model.from_arrays(**parts).latent_words
    assert words[1:4] == [
        "centre of mass upwards, in 10 m",
        "rotation about the centre of mass, pitch, in 10 rad",
        "joints of the rear legs, in 10 rad",
    ]
    assert len(words) == 6
    assert romc.Model.load(MODELS / "paper-2d.json").latent_words == []


def losses_toml(actuators):
    """The file of losses, with the moments of a leg in a table of their own."""
    lines = lambda values: "".join(f"{name} = {value}\n" for name, value in values.items())
    joints = {name: values for name, values in actuators.items() if name != "legs"}
    return f"[actuators]\n{lines(joints)}[legs]\n{lines(actuators['legs'])}"


def test_model_of_arrays_equals_the_import_of_a_file(parts, command_line, tmp_path):
    arrays = {f"xi.{phase}": xi for phase, xi in parts["xi"].items()}
    for part in ("encoder", "decoder"):
        arrays[f"{part}.weight"], arrays[f"{part}.bias"] = parts[part]
    np.savez(tmp_path / "net.npz", **arrays)
    (tmp_path / "terms.json").write_text(json.dumps(parts["library"]))
    arguments = ["import", "net.npz", "--library", "terms.json", "--scaling", parts["scaling"], "--robot", "go1"]
    arguments += ["--wrench-frame", parts["wrench_frame"]]
    (tmp_path / "losses.toml").write_text(losses_toml(parts["actuators"]))
    arguments += ["--actuators", "losses.toml"]
    arguments += ["--input-scaling", ",".join(map(repr, parts["input_scaling"]))]
    inputs = [JUMPS / "train_01.csv.gz", JUMPS / "train_02.csv.gz"]
    command_line.json(*arguments, "--inputs-from", *inputs, "--output", "net.json")
    expected = json.loads((tmp_path / "net.json").read_text())
    found = romc.Model.from_arrays(**parts, inputs_from=inputs, name="net").to_dict()
    assert expected.pop("provenance")["format"] == "npz"
    assert found.pop("provenance")["format"] == "arrays"
    assert found == expected


def test_layouts_and_number_types_make_the_same_model(parts):
    expected = romc.Model.from_arrays(**parts)
    turned = {
        "encoder": (parts["encoder"][0].T, parts["encoder"][1]),
        "decoder": (np.asfortranarray(parts["decoder"][0]), parts["decoder"][1].tolist()),
        "xi": {name: xi.T.tolist() for name, xi in parts["xi"].items()},
    }
    found = romc.Model.from_arrays(**{**parts, **turned})
    rng = np.random.default_rng(1)
    x = rng.normal(size=(4, 18))
    assert np.array_equal(found.encode(x), expected.encode(x))
    for phase in expected.xi:
        assert np.array_equal(found.xi[phase], expected.xi[phase])
    single = romc.Model.from_arrays(**{**parts, "encoder": (parts["encoder"][0].astype(np.float32), None)})
    weights = parts["encoder"][0].astype(np.float32).astype(np.float64)
    np.testing.assert_allclose(single.encode(x), parts["scaling"] * x @ weights.T, rtol=1e-13, atol=1e-15)


def test_xi_is_a_read_only_view(model):
    xi = model.xi["contact"]
    assert xi.shape == (len(model.library), model.latent_dim)
    assert np.shares_memory(xi, model.xi["contact"])
    with pytest.raises(ValueError):
        xi[0, 0] = 1.0


def test_rows_of_any_memory_order_are_taken(model, jump):
    x = np.array(jump.x[:20])
    expected = model.encode(x)
    assert np.array_equal(model.encode(np.asfortranarray(x)), expected)
    assert np.array_equal(model.encode(np.repeat(x, 2, axis=0)[::2]), expected)
    assert np.array_equal(model.encode(x[3]), expected[3])
    with pytest.raises(romc.ModelError, match="rows of 17"):
        model.encode(x[:, :17])


def test_faults_of_arrays_name_tensor_and_index(parts):
    def refusal(**changes):
        with pytest.raises(romc.ModelError) as caught:
            romc.Model.from_arrays(**{**parts, **changes})
        return caught.value

    weights, bias = parts["encoder"]
    broken = weights.copy()
    broken[2, 5] = np.inf
    error = refusal(encoder=(broken, bias))
    assert (error.tensor, error.row, error.column) == ("encoder.weight", 2, 5)
    xi = {name: value.copy() for name, value in parts["xi"].items()}
    xi["flight"][3, 1] = np.nan
    error = refusal(xi=xi)
    assert (error.tensor, error.row, error.column) == ("xi.flight", 3, 1)
    error = refusal(encoder=(weights[:, :17], bias))
    assert error.tensor == "encoder.weight" and "18" in str(error)
    error = refusal(decoder=(parts["decoder"][0], parts["decoder"][1][:-1]))
    assert error.tensor == "decoder.bias"
    error = refusal(xi={name: value[:-1] for name, value in parts["xi"].items()})
    assert error.tensor.startswith("xi.")
    error = refusal(encoder=(weights, bias, bias))
    assert "found an array, expected (weights, bias)" in str(error)
    error = refusal(encoder=(weights + 0j, bias))
    assert error.tensor == "encoder.weight" and "complex" in str(error)
    error = refusal(encoder=(np.vstack([weights[:-1], weights[:1]]), bias))
    assert "singular values" in str(error)
    assert isinstance(error, ValueError)


def test_options_are_named_as_arguments(parts):
    with pytest.raises(romc.ModelError) as caught:
        romc.Model.from_arrays(**{**parts, "xi": {"jump": parts["xi"]["contact"]}})
    assert 'phases={"jump": "any"' in str(caught.value) or "phases" in str(caught.value)
    assert "--" not in str(caught.value)
    with pytest.raises(romc.RomcError, match="unknown robot"):
        romc.Model.from_arrays(**{**parts, "robot": "go3"})
    with pytest.raises(romc.RomcError, match="xi_layout: found"):
        romc.Model.from_arrays(**parts, xi_layout="sideways")


def test_faults_of_a_file_name_tensor_and_index(tmp_path):
    document = json.loads((MODELS / "go1-d4.json").read_text())
    document["encoder"]["weights"][3][2] = "much"
    path = tmp_path / "bad.json"
    path.write_text(json.dumps(document))
    with pytest.raises(romc.ModelError) as caught:
        romc.Model.load(path)
    assert (caught.value.tensor, caught.value.row, caught.value.column) == ("encoder.weights", 3, 2)
    assert caught.value.file == str(path)
    with pytest.raises(romc.ModelError, match="none.json: no such file and no model of the package"):
        romc.Model.load(tmp_path / "none.json")


def test_shorthand_library_has_the_documented_order():
    library = romc.Library(degree=2, inputs=True)
    model = romc.Model.from_arrays(xi={"contact": np.ones((7, 1))}, library=library)
    assert model.library == ["1", "z1", "dz1", "z1^2", "z1*dz1", "dz1^2", "u1"]
    assert library.shorthand() == "degree=2,inputs"
    assert model.phases == {"contact": "any"}


def test_layers_with_an_activation_are_a_nonlinear_encoder():
    rng = np.random.default_rng(2)
    layers = [(rng.normal(size=(8, 18)), rng.normal(size=8)), (rng.normal(size=(2, 8)), np.zeros(2))]
    model = romc.Model.from_arrays(
        encoder=layers, activation="tanh", xi={"contact": np.ones((5, 2))}, library=romc.Library(), robot="go1"
    )
    x = rng.normal(size=(3, 18))
    hidden = np.tanh(x @ layers[0][0].T + layers[0][1])
    np.testing.assert_allclose(model.encode(x), hidden @ layers[1][0].T, rtol=1e-12, atol=1e-12)
    jacobian = layers[1][0] @ np.diag(1 - hidden[0] ** 2) @ layers[0][0]
    np.testing.assert_allclose(model.encode_velocity(x[1], x[0]), jacobian @ x[1], rtol=1e-11, atol=1e-11)
    with pytest.raises(romc.ModelError, match="nonlinear encoder"):
        model.encode_velocity(x[1])


def test_model_is_saved_pickled_and_compared(model, tmp_path):
    model.save(tmp_path / "m.json")
    again = romc.Model.load(tmp_path / "m.json")
    assert again == model and hash(again) == hash(model)
    assert pickle.loads(pickle.dumps(model)) == model
    other = romc.Model.load(MODELS / "go1-d6.json")
    assert other != model
    with pytest.raises(romc.ModelError, match="there already"):
        other.save(tmp_path / "m.json")
    assert "go1-d4" in repr(model) and "4 latent coordinates" in repr(model)


def test_latent_model_says_what_it_lacks(jump):
    model = romc.Model.load(MODELS / "paper-2d.json")
    with pytest.raises(romc.ModelError) as caught:
        model.encode(jump.x)
    assert caught.value.tensor == "encoder"
    with pytest.raises(romc.ModelError):
        model.simulate(jump)
    with pytest.raises(romc.ModelError, match="expected one of contact, flight"):
        model.acceleration("jump", [0.0, 0.0], [0.0, 0.0], [0.0, 0.0])


def test_jax_arrays_are_arrays(parts):
    jax = pytest.importorskip("jax")
    encoder = tuple(jax.numpy.asarray(value, dtype=jax.numpy.float32) for value in parts["encoder"])
    model = romc.Model.from_arrays(**{**parts, "encoder": encoder})
    expected = tuple(np.asarray(value, dtype=np.float64) for value in encoder)
    assert model == romc.Model.from_arrays(**{**parts, "encoder": expected})


def test_affine_pipeline_of_scikit_learn_is_an_autoencoder(jump):
    decomposition = pytest.importorskip("sklearn.decomposition")
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    pipeline = make_pipeline(StandardScaler(), decomposition.PCA(3, whiten=True)).fit(jump.x)
    xi = {"contact": np.ones((7, 3))}
    model = romc.Model.from_arrays(encoder=pipeline, decoder=pipeline, xi=xi, library=romc.Library(), robot="go1")
    z = pipeline.transform(jump.x)
    np.testing.assert_allclose(model.encode(jump.x), z, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(model.decode(z), pipeline.inverse_transform(z), rtol=1e-9, atol=1e-9)
    kernel = decomposition.KernelPCA(3, kernel="rbf").fit(jump.x)
    with pytest.raises(romc.ModelError, match="nonlinear KernelPCA"):
        romc.Model.from_arrays(encoder=kernel, xi=xi, library=romc.Library(), robot="go1")


RECORDED = [JUMPS / "train_01.csv.gz", JUMPS / "train_02.csv.gz"]


def test_model_that_misses_its_recordings_is_refused_with_the_slip(parts):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        romc.Model.from_arrays(**parts, inputs_from=RECORDED)
    wrong = {**parts, "scaling": 10 * parts["scaling"]}
    with pytest.raises(romc.ModelError, match='scaling="0.1"') as caught:
        romc.Model.from_arrays(**wrong, inputs_from=RECORDED)
    assert "unchecked=True" in str(caught.value) and "--" not in str(caught.value)
    with pytest.warns(romc.RomcWarning, match="misses the recordings") as warned:
        taken = romc.Model.from_arrays(**wrong, inputs_from=RECORDED, unchecked=True)
    assert warned[0].filename == __file__
    assert taken.to_dict()["scaling"]["state"] == 10 * parts["scaling"]


def test_actuators_are_a_mapping_or_a_file_and_checked(parts, tmp_path):
    given = parts["actuators"]
    leg = {name: values if name == "legs" else values[:3] for name, values in given.items()}
    (tmp_path / "losses.toml").write_text(losses_toml(leg))
    for actuators in (given, leg, tmp_path / "losses.toml", str(tmp_path / "losses.toml")):
        model = romc.Model.from_arrays(**{**parts, "actuators": actuators})
        assert model.to_dict()["actuators"] == given
    without = romc.Model.from_arrays(**{**parts, "actuators": None})
    assert "actuators" not in without.to_dict()
    # The equations were learned with other torques than those of the motors.
    with pytest.warns(romc.RomcWarning, match="below that of a constant"):
        romc.Model.from_arrays(**{**parts, "actuators": None}, inputs_from=RECORDED)
    with pytest.raises(romc.RomcError, match="actuators.dry: found 2 numbers, expected 12"):
        romc.Model.from_arrays(**{**parts, "actuators": {**given, "dry": [0.1, 0.2]}})
    with pytest.raises(romc.RomcError, match="joint fr.kn: found -0.5"):
        romc.Model.from_arrays(**{**parts, "actuators": {**leg, "viscous": [1.0, 1.0, -0.5]}})
    with pytest.raises(romc.RomcError, match="cannot read"):
        romc.Model.from_arrays(**{**parts, "actuators": tmp_path / "none.toml"})
    with pytest.raises(romc.RomcError, match="actuators.armature: found nothing"):
        romc.Model.from_arrays(**{**parts, "actuators": {"viscous": [1.0] * 3, "dry": [0.1] * 3}})
    with pytest.raises(romc.RomcError, match="actuators.stiction: found an unknown array"):
        romc.Model.from_arrays(**{**parts, "actuators": {**leg, "stiction": [1.0] * 3}})
    with pytest.raises(romc.RomcError, match="actuators.legs.calf_kg_m: found nothing"):
        legs = {name: value for name, value in given["legs"].items() if name != "calf_kg_m"}
        romc.Model.from_arrays(**{**parts, "actuators": {**leg, "legs": legs}})
    with pytest.raises(romc.RomcError, match="actuators.legs.thigh_kg_m2: found -1"):
        romc.Model.from_arrays(**{**parts, "actuators": {**leg, "legs": {**given["legs"], "thigh_kg_m2": -1.0}}})
    with pytest.raises(romc.RomcError, match="without a robot"):
        romc.Model.from_arrays(**{**parts, "robot": None})


def test_mean_and_order_of_a_trainer(parts):
    # A trainer that subtracted the mean, with the body's coordinates first.
    (W, b), (D, c), s = parts["encoder"], parts["decoder"], parts["scaling"]
    mean = np.linspace(-0.4, 0.5, 18)
    order = np.r_[12:18, 0:12]
    centred = {"encoder": (W[:, order], b + W @ (s * mean)), "decoder": (D[order], (c - s * mean)[order])}
    foreign = {**parts, **centred}
    model = romc.Model.from_arrays(**foreign, mean=mean[order], order="body,fr,fl,rr,rl")
    expected = romc.Model.from_arrays(**parts)
    x = np.random.default_rng(3).normal(size=(5, 18))
    np.testing.assert_allclose(model.encode(x), expected.encode(x), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(model.decode(x[:, :6]), expected.decode(x[:, :6]), rtol=1e-12, atol=1e-12)
    with pytest.raises(romc.ModelError, match='order="body,'):
        romc.Model.from_arrays(**{**foreign, "encoder": (W[:, order], b), "decoder": (D[order], c[order])},
                               inputs_from=RECORDED)
    with pytest.raises(romc.ModelError, match="18 coordinates once"):
        romc.Model.from_arrays(**parts, order="body,fr,fl")


def test_robot_of_a_file_travels_with_the_model(parts, tmp_path):
    model = romc.Model.from_arrays(**{**parts, "robot": ROOT / "examples" / "robots" / "solo12.toml"})
    assert model.to_dict()["robot"]["name"] == "solo12"
    assert "solo12" in repr(model)
    model.save(tmp_path / "m.json")
    assert romc.Model.load(tmp_path / "m.json") == model
    with pytest.raises(romc.RomcError, match="cannot read the file") as caught:
        romc.Model.from_arrays(**{**parts, "robot": tmp_path / "none.toml"})
    assert caught.value.file == str(tmp_path / "none.toml")


def test_factors_of_inputs_stand_beside_deviations_of_states(parts):
    std = np.linspace(0.1, 0.4, 18)
    model = romc.Model.from_arrays(**{**parts, "scaling": None, "input_scaling": 0.25}, std=std)
    scaling = model.to_dict()["scaling"]
    np.testing.assert_allclose(scaling["state"], 1 / std, rtol=1e-14)
    assert scaling["input"] in (0.25, [0.25] * 18)


def test_order_of_the_terms_is_stated_or_asked_for():
    xi = np.random.default_rng(4).normal(size=(7, 1))
    library = romc.Library(degree=1, trigonometric=True)
    with pytest.raises(romc.RomcError, match=r'library_order="paper" \(cos\(z1\) in row 5\)'):
        romc.Model.from_arrays(xi=xi, library=library)
    rows = {"paper": [0, 1, 2, 3, 5, 4, 6], "interleaved": [0, 1, 2, 3, 5, 4, 6], "romc": range(7)}
    for order, places in rows.items():
        model = romc.Model.from_arrays(xi=xi, library=library, library_order=order)
        assert model.library == ["1", "z1", "dz1", "sin(z1)", "sin(dz1)", "cos(z1)", "cos(dz1)"]
        assert np.array_equal(model.xi["always"], xi[places])
        stated = romc.Library(degree=1, trigonometric=True, order=order)
        assert romc.Model.from_arrays(xi=xi, library=stated) == model
    with pytest.raises(romc.ModelError, match="expected one order"):
        romc.Model.from_arrays(xi=xi, library=stated, library_order="paper")
    with pytest.raises(romc.RomcError, match="expected one of paper, interleaved, romc"):
        romc.Model.from_arrays(xi=xi, library=library, library_order="mine")


def test_arguments_that_are_missing_are_named_with_a_remedy():
    with pytest.raises(romc.ModelError, match="no candidate terms for `xi.contact`") as caught:
        romc.Model.from_arrays(xi={"contact": np.ones((7, 2))})
    assert 'library=[...], the list of terms; for this shape perhaps library="degree=1,inputs"' in str(caught.value)
    with pytest.raises(romc.ModelError, match="no tensor for xi.PHASE"):
        romc.Model.from_arrays(library=romc.Library())


def test_files_of_other_tools_are_named_with_the_lines_that_convert_them(tmp_path):
    path = tmp_path / "net.pt"
    path.write_bytes(b"PK\x03\x04 net/data.pkl")
    with pytest.raises(romc.ModelError, match="found a PyTorch file") as caught:
        romc.Model.load(path)
    assert "Model.from_arrays, from_torch" in str(caught.value)
    assert "\n    import torch, safetensors.torch\n" in str(caught.value)
