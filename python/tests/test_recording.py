import csv
import gzip

import numpy as np
import pytest
import romc

from conftest import JUMPS

PATH = JUMPS / "test_01.csv.gz"


def columns(path):
    """The numbers of a file by column, read without romc."""
    with gzip.open(path, "rt") as file:
        text = file.read()
    separator = ";" if ";" in text.partition("\n")[0] else ","
    rows = list(csv.reader(text.splitlines(), delimiter=separator))
    numbers = [[float(cell.replace(",", ".")) for cell in row] for row in rows[1:] if row]
    return dict(zip(rows[0], np.array(numbers).T))


def test_arrays_have_the_bits_of_the_file(jump):
    file = columns(PATH)
    assert np.array_equal(jump.t, file["Time"])
    for index, name in [(0, "fr.hx"), (5, "fl.kn"), (11, "rl.kn")]:
        assert np.array_equal(jump.x[:, index], file[f"{name} Position"])
        assert np.array_equal(jump.dx[:, index], file[f"{name} Velocity"])
        assert np.array_equal(jump.torque[:, index], file[f"{name} Torque"])
    assert np.array_equal(jump.x[:, 14], file["Body linear Position z"])
    assert np.array_equal(jump.dx[:, 17], file["Body angular Velocity z"])
    assert np.array_equal(jump.feet[:, 2], file["rr Foot"] == 1.0)
    assert jump.x.shape == (len(file["Time"]), 18) and jump.feet.dtype == bool


def test_arrays_are_read_only_views_of_one_memory(jump):
    segment = jump[0]
    for name in ["t", "x", "dx", "ddx", "torque", "feet"]:
        array = getattr(segment, name)
        assert np.shares_memory(array, getattr(jump[0], name)), name
        assert array.flags.c_contiguous and not array.flags.owndata, name
        with pytest.raises(ValueError):
            array[0] = 0


def test_arrays_outlive_the_recording():
    x = romc.read(PATH)[0].x
    expected = romc.read(PATH).x.copy()
    assert np.array_equal(x, expected)


def test_recording_of_arrays_equals_that_of_the_file(jump):
    again = romc.Recording.from_arrays(jump.t, jump.x, jump.dx, jump.torque, jump.feet, ddx=jump.ddx)
    for name in ["t", "x", "dx", "ddx", "torque", "feet"]:
        assert np.array_equal(getattr(again, name), getattr(jump, name)), name
    # Lists, single precision and numbers as flags convert.
    single = romc.Recording.from_arrays(
        jump.t.tolist(), jump.x.astype(np.float32), jump.dx, jump.torque, jump.feet.astype(int)
    )
    assert np.array_equal(single.x, jump.x.astype(np.float32))
    assert np.array_equal(single.feet, jump.feet)


def test_recording_saved_is_read_back(jump, tmp_path):
    path = tmp_path / "jump.csv.gz"
    jump.save(path)
    assert np.array_equal(romc.read(path).dx, jump.dx)
    with pytest.raises(romc.RomcError, match="already exists; pass force=True to replace it"):
        jump.save(path)
    jump.save(path, force=True)


def test_chained_jumps_are_segments(jump):
    twice = romc.Recording.from_arrays(
        np.concatenate([jump.t, jump.t]),
        *(np.vstack([array, array]) for array in (jump.x, jump.dx, jump.torque, jump.feet)),
    )
    assert len(twice) == 2 and len(twice[-1]) == len(jump.t)
    assert [len(segment) for segment in twice] == [len(jump.t)] * 2
    with pytest.raises(romc.RecordingError, match="found 2 segments"):
        twice.x
    with pytest.raises(IndexError):
        twice[2]


def test_bad_cell_is_named_with_row_and_column(tmp_path):
    with gzip.open(PATH, "rt") as file:
        lines = file.read().splitlines()
    separator = ";" if ";" in lines[0] else ","
    place = lines[0].split(separator).index("fl.hy Position")
    cells = lines[6].split(separator)
    cells[place] = "oops"
    lines[6] = separator.join(cells)
    path = tmp_path / "bad.csv"
    path.write_text("\n".join(lines))
    with pytest.raises(romc.RecordingError) as caught:
        romc.read(path)
    assert (caught.value.row, caught.value.column) == (7, "fl.hy Position")
    assert caught.value.file == str(path) and "oops" in str(caught.value)


def test_number_that_is_not_finite_is_named_with_its_sample(jump):
    x = jump.x.copy()
    x[9, 4] = np.nan
    with pytest.raises(romc.RecordingError) as caught:
        romc.Recording.from_arrays(jump.t, x, jump.dx, jump.torque, jump.feet)
    assert (caught.value.row, caught.value.column) == (9, "fl.hy Position")


@pytest.mark.parametrize(
    "name, value",
    [("x", np.zeros((3, 18))), ("torque", np.zeros((5, 11))), ("feet", np.full((5, 4), 0.5)), ("t", "now")],
)
def test_arrays_that_do_not_fit_are_refused(name, value):
    arrays = {
        "t": np.arange(5.0),
        "x": np.zeros((5, 18)),
        "dx": np.zeros((5, 18)),
        "torque": np.zeros((5, 12)),
        "feet": np.ones((5, 4), bool),
    }
    with pytest.raises(romc.RecordingError) as caught:
        romc.Recording.from_arrays(**{**arrays, name: value})
    assert caught.value.column == name


def test_missing_file_is_named(tmp_path):
    with pytest.raises(romc.RecordingError, match="no such file"):
        romc.read(tmp_path / "none.csv")


def test_inputs_are_torques_and_the_wrench(model, jump):
    u = jump.inputs(model)
    assert u.shape == (len(jump.t), 18)
    assert np.array_equal(jump.inputs("go1")[:, :12], jump.torque)
    flight = ~jump.feet.any(axis=1)
    assert flight.any() and not u[flight, 12:].any()
    with pytest.raises(romc.RomcError, match="unknown robot"):
        jump.inputs("go3")


def foreign_log(path, jump):
    """A jump as another program logs it: degrees, ms, left legs first, quaternion, forces at the feet."""
    legs, joints = ["lf", "rf", "lh", "rh"], ["haa", "hfe", "kfe"]
    own = [3 * leg + joint for leg in (1, 0, 3, 2) for joint in range(3)]
    half = jump.x[:, 15:18] / 2
    (cr, cp, cy), (sr, sp, sy) = np.cos(half).T, np.sin(half).T
    table = {"stamp_ms": 1e3 * jump.t}
    table.update({f"q/{leg}_{joint}": np.rad2deg(jump.x[:, own[3 * i + k]])
                  for i, leg in enumerate(legs) for k, joint in enumerate(joints)})
    table.update({f"effort/{leg}_{joint}": jump.torque[:, own[3 * i + k]]
                  for i, leg in enumerate(legs) for k, joint in enumerate(joints)})
    table.update(zip(["px", "py", "pz"], jump.x[:, 12:15].T))
    table.update(qw=cr * cp * cy + sr * sp * sy, qx=sr * cp * cy - cr * sp * sy,
                 qy=cr * sp * cy + sr * cp * sy, qz=cr * cp * sy - sr * sp * cy)
    table.update({f"grf_{leg}": 80.0 * jump.feet[:, foot] for leg, foot in zip(legs, (1, 0, 3, 2))})
    rows = zip(*(column.tolist() for column in table.values()))
    path.write_text("\n".join(["\t".join(table), *("\t".join(map(repr, row)) for row in rows)]) + "\n")


MAP = {
    "time": {"column": "stamp_ms", "unit": "ms"},
    "names": {"legs": ["rf", "lf", "rh", "lh"], "joints": ["haa", "hfe", "kfe"]},
    "joint": {
        "position": {"columns": "q/{leg}_{joint}", "unit": "deg"},
        "torque": {"columns": "effort/{leg}_{joint}"},
    },
    "body": {
        "position": {"columns": ["px", "py", "pz"]},
        "orientation": {"columns": ["qw", "qx", "qy", "qz"], "order": "wxyz"},
    },
    "feet": {"columns": "grf_{leg}", "threshold": 20.0},
}


def test_log_of_another_program_by_a_map(jump, command_line, tmp_path):
    log = tmp_path / "log.tsv"
    foreign_log(log, jump)
    with pytest.warns(romc.RomcWarning, match="differences"):
        found = romc.read(log, columns=MAP, clock="recorded")
    np.testing.assert_allclose(found.x, jump.x, atol=1e-9)
    np.testing.assert_allclose(found.torque, jump.torque, atol=1e-9)
    assert np.array_equal(found.feet, jump.feet)
    # The guessed map reads the same, from its text in a file, and so does the command line.
    (tmp_path / "map.toml").write_text(romc.guess_columns(log))
    with pytest.warns(romc.RomcWarning):
        guessed = romc.read(log, columns=tmp_path / "map.toml", clock="recorded")
    np.testing.assert_allclose(guessed.x, found.x, atol=1e-12)
    command_line.json("convert", log, "--columns", "map.toml", "--output", "jump.csv")
    written = romc.read(tmp_path / "jump.csv", clock="recorded")
    for name in ["t", "x", "dx", "torque", "feet"]:
        assert np.array_equal(getattr(written, name), getattr(guessed, name)), name
    wrong = {**MAP, "feet": {"columns": "grf_{leg}"}}
    with pytest.raises(romc.RecordingError, match="found 80, expected contact 0 or 1"):
        romc.read(log, columns=wrong)


def test_clock_that_runs_too_fast_is_rebuilt_as_on_the_command_line(jump, model, command_line, tmp_path):
    fast = romc.Recording.from_arrays(jump.t / 1.15, jump.x, jump.dx, jump.torque, jump.feet)
    fast.save(tmp_path / "fast.csv")
    kept = romc.read(tmp_path / "fast.csv", clock="recorded")
    assert np.array_equal(kept.t, fast.t)
    with pytest.warns(romc.RomcWarning, match='rebuilt from the motion.*clock="recorded"') as warned:
        mended = romc.read(tmp_path / "fast.csv")
    assert warned[0].filename == __file__
    assert mended.t[-1] == pytest.approx(jump.t[-1] - jump.t[0] + mended.t[0], rel=0.02)
    expected = command_line.json("simulate", command_line_model(tmp_path, model), "fast.csv", codes=(0, 1))["rollouts"]
    assert model.simulate(mended).metrics == expected


def command_line_model(folder, model):
    model.save(folder / "m.json")
    return "m.json"


def test_topics_at_two_rates_are_one_recording(jump, tmp_path):
    """Joints at 500 Hz, the trunk at 250 Hz: a jump with its landings, where velocities change within a sample."""
    def write(name, every, table):
        rows = zip(*(np.asarray(column)[::every].tolist() for column in table.values()))
        lines = [",".join(table), *(",".join(map(repr, row)) for row in rows)]
        (tmp_path / name).write_text("\n".join(lines) + "\n")

    clock = {"t": jump.t}
    joints = {f"q{i}": jump.x[:, i] for i in range(12)} | {f"dq{i}": jump.dx[:, i] for i in range(12)}
    joints |= {f"tau{i}": jump.torque[:, i] for i in range(12)} | {f"c{i}": 1.0 * jump.feet[:, i] for i in range(4)}
    body = {f"p{i}": jump.x[:, 12 + i] for i in range(6)} | {f"v{i}": jump.dx[:, 12 + i] for i in range(6)}
    write("joints.csv", 1, clock | joints)
    write("body.csv", 2, clock | body)
    file = {"file": "body.csv", "time": "t"}
    columns = {
        "time": {"column": "t"},
        "joint": {"position": {"columns": "q{0}"}, "velocity": {"columns": "dq{0}"}, "torque": {"columns": "tau{0}"}},
        "body": {
            "position": {**file, "columns": ["p0", "p1", "p2"]},
            "orientation": {**file, "columns": ["p3", "p4", "p5"]},
            "velocity": {**file, "columns": ["v0", "v1", "v2"]},
            "angular_velocity": {**file, "columns": ["v3", "v4", "v5"]},
        },
        "feet": {"columns": "c{0}"},
    }
    with pytest.warns(romc.RomcWarning, match="clocks of their own"):
        found = romc.read(tmp_path / "joints.csv", columns=columns, clock="recorded")
    assert np.array_equal(found.t, jump.t) and np.array_equal(found.x[:, :12], jump.x[:, :12])
    state, velocity = np.abs(found.x - jump.x), np.abs(found.dx - jump.dx).max(axis=1)
    print(f"states to {state.max():.1e}, velocities to {np.quantile(velocity, 0.9):.1e} in 90 % of samples, "
          f"{velocity.max():.1e} in all")
    assert state.max() < 1e-4
    assert np.quantile(velocity, 0.9) < 1e-3 and velocity.max() < 0.1
