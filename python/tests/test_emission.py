import json

import numpy as np
import pytest
import romc

from conftest import JUMPS, MODELS

TARGETS = ["latex", "c", "rust", "markdown", "mathml", "python", "casadi", "matlab"]


@pytest.mark.parametrize("name", ["go1-d4", "go1-d6", "go2-async-d4", "paper-2d"])
def test_files_have_the_bytes_of_the_command_line(name, command_line, tmp_path):
    path = MODELS / f"{name}.json"
    command_line.json("compile", path, "--emit", ",".join(TARGETS), "--out-dir", "expected")
    paths = romc.Model.load(path).compile(TARGETS, tmp_path / "found")
    assert all(path.is_file() for path in paths)
    found = {path.relative_to(tmp_path / "found"): path.read_bytes() for path in paths}
    folder = tmp_path / "expected"
    expected = {
        path.relative_to(folder): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and path.relative_to(folder) in found
    }
    assert len(found) >= 15 and found == expected


@pytest.mark.parametrize(
    "options, arguments",
    [
        ({"precision": "f32", "sincos": "library"}, ["--precision", "f32", "--sincos", "library"]),
        ({"units": "scaled", "digits": 3}, ["--units", "scaled", "--digits", "3"]),
        ({"units": "physical", "significant": 4}, ["--units", "physical", "--significant", "4"]),
        ({"units": "physical"}, ["--units", "physical"]),
        ({"form": "align", "width": 22, "siunitx": True}, ["--form", "align", "--width", "22", "--siunitx"]),
        ({"rename": {"z1": "x"}, "as_learned": True}, ["--rename", "z1=x", "--as-learned"]),
    ],
)
def test_options_are_those_of_the_command_line(options, arguments, model, command_line, tmp_path):
    path = MODELS / "go1-d4.json"
    command_line.json("compile", path, "--emit", "latex,c", "--out-dir", "expected", *arguments)
    for path in model.compile(["latex", "c"], tmp_path / "found", **options):
        assert path.read_bytes() == (tmp_path / "expected" / path.name).read_bytes(), path.name


def test_controller_is_a_target(model, tmp_path):
    paths = model.compile("controller", tmp_path)
    assert any(path.name == "Cargo.toml" for path in paths)


def test_latex_is_the_file_for_papers(model, tmp_path):
    equations = model.equations(significant=3, units="si")
    [path] = [path for path in model.compile("latex", tmp_path, significant=3) if path.name == "go1_d4.tex"]
    assert equations.latex() == path.read_text()
    assert equations.terms("contact")[0][2] == (pytest.approx(1.532, abs=1e-3), "u1")
    assert equations.markdown().startswith("<!-- romc")


def test_print_shows_equations_in_physical_units(model, command_line):
    [contact, flight] = str(model.equations()).split("\n\n")[1:]
    assert contact.startswith("contact (at least one foot on the ground)\n")
    [u1] = [xi for xi, term in model.equations().terms("contact")[0] if term == "u1"]
    # A force of 1 N accelerates the centre of mass by 1/mass: 13.0 kg.
    assert u1 == pytest.approx(1 / 13.0, abs=1e-3)
    assert f" {u1:.3g} u1" in contact.splitlines()[1]
    assert flight.splitlines()[2] == "  ddz2 = -9.81"
    head, rest = str(model).split("\n\n", 1)
    assert head == "go1-d4: 4 latent coordinates of the robot go1, phases contact, flight"
    assert rest == str(model.equations())
    assert "z2  centre of mass upwards, m; input u2 in N\n" in rest
    assert max(map(len, str(model).splitlines())) <= 80
    # The same text as the command line's.
    assert rest in command_line.run("inspect", MODELS / "go1-d4.json").stdout


def test_digits_names_and_units_reach_the_text(model):
    assert "ddz1 = -0.596 dz1 - 0.581 dz2 + 1.53 u1\n" in str(model.equations(significant=3, units="si"))
    assert "ddz1 = -0.6 dz1 - 0.6 dz2 + 2 u1\n" in str(model.equations(significant=1, units="si"))
    assert "-9.532 " in str(model.equations(significant=4))
    renamed = str(model.equations(rename={"z1": "x"}))
    assert renamed.startswith("x   centre of mass forwards, m") and "ddx" in renamed
    latent_only = romc.Model.load(MODELS / "paper-2d.json")
    assert str(latent_only).startswith("paper-2d: 2 latent coordinates, phases contact, flight\n\ncontact (")
    assert str(latent_only.equations()) == str(latent_only.equations(units="si"))
    with pytest.raises(romc.RomcError, match='units: found "cm", expected one of si, scaled, physical'):
        model.equations(units="cm")


def test_notebook_formula_has_every_phase():
    equations = romc.Model.load(MODELS / "paper-2d.json").equations()
    text = equations._repr_latex_()
    assert text.startswith("$$\\begin{array}{l}") and text.endswith("\\end{array}$$")
    assert r"\text{contact: at least one foot on the ground}" in text
    assert r"\ddot{z}_1 = 0.29 - 1.22\dot{z}_1 - 1.00\sin(\dot{z}_1) + 51.05u_1" in text
    assert text.count("{") == text.count("}")
    assert equations.phases == ["contact", "flight"]
    assert equations.terms("flight")[1] == [(0.42, "dz1"), (0.52, "sin(dz1)")]
    with pytest.raises(KeyError, match="contact, flight"):
        equations.terms("jump")


@pytest.mark.parametrize("name", ["go1-d4", "go1-d6", "paper-2d"])
def test_text_is_equal_as_the_model(name, command_line, tmp_path):
    path = MODELS / f"{name}.json"
    (tmp_path / "equations.txt").write_text(romc.Model.load(path).equations(units="si").to_text())
    answer = command_line.json("check", path, "equations.txt")
    assert answer["equal"], answer


def test_unknown_values_are_refused_with_the_known_ones(model, tmp_path):
    with pytest.raises(romc.RomcError, match="targets: found \"fortran\", expected one of latex, c, rust"):
        model.compile("fortran", tmp_path)
    with pytest.raises(romc.RomcError, match="precision: found \"f16\", expected one of f64, f32"):
        model.compile("c", tmp_path, precision="f16")


def test_foreign_files_stay_unless_forced(model, tmp_path):
    (tmp_path / "go1_d4.c").write_text("mine")
    with pytest.raises(romc.RomcError):
        model.compile("c", tmp_path)
    assert (tmp_path / "go1_d4.c").read_text() == "mine"
    model.compile("c", tmp_path, force=True)
    assert "go1_d4_encode" in (tmp_path / "go1_d4.c").read_text()


def test_simplified_model_is_that_of_the_command_line(model, command_line, tmp_path):
    domain = [JUMPS / "train_01.csv.gz", JUMPS / "train_02.csv.gz"]
    arguments = ["--emit", "markdown", "--out-dir", "out", "--tolerance", "5%", "--save-model", "short.json"]
    answer = command_line.json("compile", MODELS / "go1-d4.json", *arguments, "--domain", *domain)
    expected = romc.Model.load(tmp_path / "short.json")
    short, certificate, page = model.simplify(domain, "5%")
    assert short.library == expected.library
    for phase, xi in expected.xi.items():
        assert np.array_equal(short.xi[phase], xi), phase
        assert not np.array_equal(xi, model.xi[phase]), phase
    assert certificate == {key: answer["simplification"][key] for key in certificate}
    assert certificate["terms"]["after"] <= certificate["terms"]["before"]
    assert page.startswith("#") or "simpl" in page
    # Coefficients whose digits were chosen are printed in full.
    assert "printed in full" in short.equations().rounding


def test_simplification_over_ranges(tmp_path):
    model = romc.Model.from_arrays(
        xi={"contact": np.array([[0.0], [-0.00003], [-9.81], [2.0004]])}, library=["z1", "dz1", "sin(z1)", "u1"]
    )
    box = {"contact": {name: (-0.1, 0.1) for name in ("z1", "dz1", "u1")}}
    short, certificate, _ = model.simplify(box, 1e-3)
    assert short.equations().terms("contact") == [[(-9.794, "z1"), (2.0, "u1")]]
    with pytest.raises(romc.RomcError, match="no range of `u1`"):
        model.simplify({"contact": {"z1": (-1, 1), "dz1": (-1, 1)}}, 1e-3)
    with pytest.raises(romc.RomcError, match="tolerance"):
        model.simplify(box, "a little")
    assert json.dumps(certificate)
