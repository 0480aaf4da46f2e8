"""Claims about what is written of a rotating beam, its model as TOML, and ``spim beam``."""

import csv
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from beams import kane, paper
from hypothesis import given
from hypothesis import strategies as st

import spim
from spim import cli, models

EXAMPLE = Path(__file__).parents[2] / "examples" / "rotating_beam.toml"
SPIN_UP = models.SpinUp(2.0, 3.0)
RECORD = models.RotationTable(np.linspace(0.0, 2.0, 40) ** 1.5, np.arange(40) / 3.0)
BEAMS = {
    "free": {},
    "radius": {"hub_radius": 0.7, "ground_spring": 40.0, "tip_inertia": 0.2},
    "jointed": {"joint_spring": 300.0, "joint_torque": 0.1, "coupling": "third"},
    "jointed, foac": {"joint_spring": 300.0, "hub_radius": 0.7},
    "driven": {"hub_inertia": None, "rotation": SPIN_UP, "hub_radius": 0.7},
    "recorded": {"hub_inertia": None, "rotation": RECORD, "coupling": "zoac"},
    "trapezoid": {"hub_inertia": None, "rotation": models.Trapezoid(2.0, 1.0, 0.3, fall=0.7)},
    "loaded": {
        "gravity": (0.1, -9.8),
        "damping": (0.05, 1e-4),
        "hub_torque": np.float64(1.0 / 3.0),
        "tip_force": np.array([30, -20]),
        "distributed_force": [[4.0, 7.0], [1e-300, 1e22]],
        "follower": True,
    },
}


def swinging(name="free", steps=4, step=1e-4, **options):
    beam = paper(**BEAMS[name])
    rate = {"v_rate": [0.5, 1.0], "theta": [0.02, 0.03]}
    z0 = beam.state(v=[0.05, 0.1], u=[1e-4, 2e-4], **rate)
    options = {"method": "gauss6"} | options
    return spim.integrate(beam, z0, (0.0, steps * step), step, **options)


# Files


def test_an_npz_file_holds_every_array_as_it_is(tmp_path):
    solution = swinging("jointed")
    solution.save(tmp_path / "run.npz")
    arrays = (
        "t z u v theta tip_u tip_v tip_xy phi1 phi2 omega rates energy work dissipated"
    ).split()
    with np.load(tmp_path / "run.npz") as file:
        assert set(file) == {*arrays, "spim_version", "method", "step", "model"}
        for name in arrays:
            assert np.array_equal(file[name], getattr(solution, name))
        assert str(file["spim_version"]) == spim.__version__
        assert str(file["method"]) == solution.method
        assert float(file["step"]) == 1e-4
        again = models.RotatingBeam.from_toml(str(file["model"]))
    assert np.array_equal(again.energy(solution.z), solution.energy)


def test_a_model_with_a_function_is_saved_without_its_text(tmp_path):
    beam = paper(hub_torque=lambda t: 1.0)
    solution = spim.integrate(beam, beam.state(), (0.0, 2e-3), 1e-3, method="srk2")
    solution.save(tmp_path / "run.npz")
    with np.load(tmp_path / "run.npz") as file:
        assert str(file["model"]) == ""
        assert np.array_equal(file["work"], solution.work)


def table(path):
    """Heading and numbers of a CSV file."""
    with path.open(newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    return head, np.array(rows, float)


def test_a_csv_file_names_units_and_reads_back_as_it_was(tmp_path):
    solution = swinging("jointed")
    solution.save(tmp_path / "run.csv")
    head, rows = table(tmp_path / "run.csv")
    assert head == (
        "t [s],u1 [m],v1 [m],theta1 [rad],u2 [m],v2 [m],theta2 [rad],phi1 [rad],phi2 [rad],"
        "u1_rate [m/s],v1_rate [m/s],theta1_rate [rad/s],u2_rate [m/s],v2_rate [m/s],"
        "theta2_rate [rad/s],omega [rad/s],joint_rate [rad/s],tip_x [m],tip_y [m],energy [J],"
        "work [J],dissipated [J]"
    ).split(",")
    # t; q with both angles; their rates; the rest.
    assert np.array_equal(rows[:, 0], solution.t)
    assert np.array_equal(rows[:, 1:9], solution.z[:, :8])
    assert np.array_equal(rows[:, 9:17], solution.rates)
    assert np.array_equal(rows[:, 17:19], solution.tip_xy)
    accounts = np.stack([solution.energy, solution.work, solution.dissipated], 1)
    assert np.array_equal(rows[:, 19:], accounts)


def test_a_prescribed_rotation_is_in_the_columns(tmp_path):
    solution = swinging("driven")
    solution.save(tmp_path / "run.csv")
    head, rows = table(tmp_path / "run.csv")
    columns = dict(zip(head, rows.T, strict=True))
    assert np.array_equal(columns["omega [rad/s]"], SPIN_UP.omega(solution.t))
    assert np.array_equal(columns["phi1 [rad]"], SPIN_UP.angle(solution.t))
    assert np.array_equal(columns["theta2_rate [rad/s]"], solution.rates[:, 5])
    assert (columns["joint_rate [rad/s]"] == 0.0).all()


@pytest.mark.parametrize(("outputs", "name"), [(None, "z"), ([0, 2], "outputs")])
def test_linear_systems_save_times_and_states_or_outputs(tmp_path, outputs, name):
    system = models.Oscillators([0.1, 10.0], [100.0, 10.0])
    solution = spim.integrate(system, [1.0, 0.0, 0.0, 2.0], (0.0, 0.3), 0.1, outputs=outputs)
    solution.save(tmp_path / "run.npz")
    solution.save(tmp_path / "run.CSV")
    states = getattr(solution, name)
    with np.load(tmp_path / "run.npz") as file:
        assert set(file) == {"t", name, "spim_version", "method", "step", "model"}
        assert np.array_equal(file["t"], solution.t)
        assert np.array_equal(file[name], states)
    head, rows = table(tmp_path / "run.CSV")
    single = "z" if name == "z" else "output"
    assert head == ["t"] + [f"{single}{i + 1}" for i in range(states.shape[1])]
    assert np.array_equal(rows, np.column_stack([solution.t, states]))


def test_outputs_of_a_beam_are_saved_alone(tmp_path):
    solution = swinging(outputs=[4])
    for suffix in ("npz", "csv"):
        solution.save(tmp_path / f"run.{suffix}")
    assert table(tmp_path / "run.csv")[0] == ["t", "output1"]
    with np.load(tmp_path / "run.npz") as file:
        assert np.array_equal(file["outputs"], solution.outputs)


def test_an_unknown_suffix_is_answered_with_those_there_are(tmp_path):
    with pytest.raises(ValueError, match=r"^path: the suffix must be .csv or .npz, got 'run.mat'$"):
        swinging().save(tmp_path / "run.mat")
    assert list(tmp_path.iterdir()) == []


# ParaView


def collection(path):
    """Times and files of a .pvd."""
    found = ElementTree.parse(path).getroot().iter("DataSet")
    return [(float(entry.get("timestep")), path.parent / entry.get("file")) for entry in found]


def test_vtk_files_hold_frames_and_nodal_values(tmp_path):
    meshio = pytest.importorskip("meshio")
    solution = swinging("radius", steps=5)
    path = solution.to_vtk(tmp_path / "new" / "vtk", every=2)
    assert path == tmp_path / "new" / "vtk" / "beam.pvd"
    entries = collection(path)
    # Each second state, and the last.
    rows = [0, 2, 4, 5]
    assert [t for t, _ in entries] == solution.t[rows].tolist()
    assert [file.name for _, file in entries] == [f"beam_000{k}.vtu" for k in range(4)]
    for row, (_, file) in zip(rows, entries, strict=True):
        mesh = meshio.read(file)
        assert np.array_equal(mesh.points[:, :2], solution.frames()[row])
        assert (mesh.points[:, 2] == 0.0).all()
        assert [(c.type, c.data.tolist()) for c in mesh.cells] == [("line", [[0, 1], [1, 2]])]
        assert set(mesh.point_data) == {"u", "v", "theta", "velocity"}
        for name in ("u", "v", "theta"):
            wanted = np.append(0.0, getattr(solution, name)[row])
            assert np.array_equal(mesh.point_data[name], wanted)


@pytest.mark.parametrize("name", BEAMS)
def test_velocities_are_the_slopes_of_the_frames(tmp_path, name):
    meshio = pytest.importorskip("meshio")
    step = 2e-6
    # Turning from the start where the hub is free.
    beam = paper(**(BEAMS[name] | {"distributed_force": None}))
    turning = {0: {}, 1: {"omega": 1.2}, 2: {"omega": 1.2, "joint_rate": -0.7, "phi2": 0.2}}
    z0 = beam.state(v=[0.05, 0.1], v_rate=[0.5, 1.0], theta=[0.02, 0.03], **turning[beam.angles])
    solution = spim.integrate(beam, z0, (0.0, 4 * step), step, method="gauss6")
    frames = solution.frames()
    slope = (frames[0] - 8.0 * frames[1] + 8.0 * frames[3] - frames[4]) / (12.0 * step)
    files = collection(solution.to_vtk(tmp_path))
    found = meshio.read(files[2][1]).point_data["velocity"]
    # Rounding of places of 8 m, 2e-15 m, over the step; the rest is of order step^4.
    assert np.abs(found[:, :2] - slope).max() <= 5e-9 * np.abs(slope).max()
    assert (found[:, 2] == 0.0).all()


def test_missing_meshio_is_answered_with_the_remedy(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "meshio", None)
    with pytest.raises(ImportError, match=r'pip install "spim\[vtk\]"'):
        swinging().to_vtk(tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("every", "error", "words"),
    [
        (0, ValueError, "every: must be 1 or more, got 0"),
        (1.5, TypeError, "every: must be a whole number, got 1.5"),
    ],
)
def test_every_of_vtk_is_checked(tmp_path, every, error, words):
    with pytest.raises(error, match=words):
        swinging().to_vtk(tmp_path, every=every)


# TOML


def same(one, other):
    """Whether beams have the same numbers: what is written, and what the core gets."""
    arrays = one._arrays.keys() == other._arrays.keys() and all(
        np.array_equal(one._arrays[name], other._arrays[name]) for name in one._arrays
    )
    return arrays and one.to_toml() == other.to_toml()


@pytest.mark.parametrize("name", BEAMS)
def test_a_beam_is_the_same_after_a_round_trip(name, tmp_path):
    beam = paper(**BEAMS[name])
    text = beam.to_toml()
    path = tmp_path / "beam.toml"
    path.write_text(text, encoding="utf-8")
    z = beam.state(v=[0.05, 0.1], v_rate=[0.5, 1.0], t=0.5)
    for source in (text, path, str(path)):
        again = models.RotatingBeam.from_toml(source)
        assert same(beam, again)
        # The derivative of a state: every load, damping and rotation.
        assert np.array_equal(again.rate(z, 0.5), beam.rate(z, 0.5))
        assert type(again.rotation) is type(beam.rotation)


def test_a_distributed_section_is_the_same_after_a_round_trip():
    beam = kane(section=models.DistributedSection(1.2, 2.8e7, 1.4e4, flap_stiffness=1.0 / 3.0))
    again = models.RotatingBeam.from_toml(beam.to_toml())
    assert again.section == beam.section
    assert same(beam, again)


POSITIVE = st.floats(1e-3, 1e3)


@given(POSITIVE, POSITIVE, st.tuples(st.floats(-1e5, 1e5), st.floats(-1e-5, 1e-5)))
def test_any_numbers_are_the_same_after_a_round_trip(length, inertia, gravity):
    beam = paper(length=length, hub_inertia=inertia, gravity=gravity)
    again = models.RotatingBeam.from_toml(beam.to_toml())
    assert (again.length, again.hub_inertia, again.gravity) == (length, inertia, gravity)


def test_toml_states_units():
    assert paper().to_toml().splitlines() == [
        "# A rotating beam for spim, in SI units",
        "",
        "[beam]",
        "length = 8.0  # m",
        "elements = 2  # of equal length",
        'coupling = "foac"  # foac, zoac or third',
        "hub_inertia = 10.0  # kg m^2",
        "hub_radius = 0.0  # m",
        "ground_spring = 0.0  # N m/rad",
        "joint_spring = inf  # N m/rad; inf locks the joint",
        "tip_mass = 0.085  # kg",
        "tip_inertia = 0.0  # kg m^2",
        "gravity = [0.0, 0.0]  # m/s^2",
        "damping = [0.0, 0.0]  # alpha [1/s], beta [s]",
        "follower = false  # forces turn with the section",
        "",
        "[section]",
        'kind = "tapered"',
        "root = [0.04596, 0.00248]  # m: width in the plane of rotation, thickness",
        "tip = [0.02673, 0.00144]  # m: width in the plane of rotation, thickness",
        "density = 2766.7  # kg/m^3",
        "youngs_modulus = 68952000000.0  # N/m^2",
    ]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"hub_torque": lambda t: t}, "hub_torque: a function cannot be written as TOML"),
        ({"tip_force": lambda t: (t, t)}, "tip_force: a function cannot be written as TOML"),
        (
            {"section": models.DistributedSection(1.0, lambda x: 2.0, 1.0)},
            "axial_stiffness: a function cannot be written as TOML; give numbers",
        ),
        (
            {"hub_inertia": None, "rotation": lambda t: 2.0 * t},
            "rotation: a function cannot be written as TOML; SpinUp, RotationTable, Trapezoid can",
        ),
    ],
)
def test_functions_are_named_that_toml_cannot_hold(changes, words):
    with pytest.raises(ValueError, match=words):
        paper(**changes).to_toml()


GOOD = paper().to_toml()
DRIVEN = GOOD.replace("hub_inertia = 10.0", "") + '[rotation]\nkind = "spin-up"\n'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            GOOD.replace("length =", "lenght ="),
            '[beam] lenght: no such key; did you mean "length"?',
        ),
        (GOOD.replace("[section]", "[sections]"), '[sections]: no such table; did you mean "sec'),
        ("length = 8.0\n" + GOOD, "length: in no table; there are beam, section, rotation, run"),
        (GOOD.replace("length = 8.0", ""), "[beam] length: is missing; give a number (m)"),
        (GOOD.replace("= 8.0", '= "8 m"'), "[beam] length: must be a number, got '8 m'"),
        (GOOD.replace("= 8.0", "= true"), "[beam] length: must be a number, got True"),
        (GOOD.replace("= 2 ", "= 2.0 "), "[beam] elements: must be a whole number, got 2.0"),
        (GOOD.replace("[0.0, 0.0]  # m/", "[0.0]  # m/"), "[beam] gravity: must be a pair of num"),
        (GOOD.replace("= false", "= 0"), "[beam] follower: must be true or false, got 0"),
        (
            GOOD.replace("density = 2766.7", ""),
            "[section] density: is missing; give a number (kg/m",
        ),
        (
            GOOD.replace('"tapered"', '"taper"'),
            "[section] kind: no such choice as 'taper'; did you",
        ),
        (
            GOOD.replace('kind = "tapered"', ""),
            "[section] kind: is missing; there are tapered, dis",
        ),
        (GOOD.replace("[beam]", "[[beam]]"), "[beam]: must be one table, got ["),
        (GOOD.replace("= 8.0", "= 8 m"), "no TOML: Expected newline or end of document after a st"),
        (GOOD.replace("= 8.0", "= 1" + "0" * 400), "[beam] length: must be a number, got 1000000"),
        (GOOD.replace("= 8.0", "= -8.0"), "length: must be positive, got -8"),
        (GOOD.replace("= 8.0", "= nan"), "length: must be finite, got nan"),
        (DRIVEN, "[rotation] speed: is missing; give a number (rad/s)"),
    ],
)
def test_bad_toml_is_answered_with_table_and_key(text, words):
    with pytest.raises(ValueError, match=".") as caught:
        models.RotatingBeam.from_toml(text)
    assert str(caught.value).startswith(words)


def test_whole_numbers_of_toml_are_taken_as_numbers():
    beam = models.RotatingBeam.from_toml(GOOD.replace("= 8.0", "= 8"))
    assert same(beam, paper())


# The command


@pytest.fixture
def config(tmp_path):
    """Writes a configuration: the example's beam, and what else is wanted."""

    def written(run="", beam=GOOD):
        path = tmp_path / "beam.toml"
        path.write_text(f"{beam}\n{run}", encoding="utf-8")
        return path

    return written


def test_the_example_is_run_as_in_python(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    cli.main(["beam", str(EXAMPLE), "--output", str(tmp_path / "out")])
    beam = models.RotatingBeam.from_toml(EXAMPLE)
    assert same(beam, paper())
    z0 = beam.state(u=[0.1, 0.2], v=[0.5, 1.0])
    solution = spim.integrate(beam, z0, (0.0, 1.0), 1e-4, method="srk2", every=20)
    with np.load(tmp_path / "out" / "beam.npz") as file:
        assert np.array_equal(file["z"], solution.z)
    assert len(table(tmp_path / "out" / "beam.csv")[1]) == 501
    printed, complaints = capsys.readouterr()
    assert complaints == ""
    *files, blank, method, steps, energy, tip = printed.splitlines()
    assert files == [str(tmp_path / "out" / f"beam.{x}") for x in ("csv", "npz", "svg", "png")]
    assert all(Path(file).stat().st_size > 1000 for file in files)
    assert blank == ""
    assert method == f"method  {solution.method}"
    assert steps.startswith("steps   10000 of 0.0001 s, t = 0 .. 1 s, in ")
    # The energy of test_totals_of_the_papers_beam; 2e-5 of it at this step.
    assert energy.startswith("energy  12596.6 J, then 12596.6 J; energy drift at most 0.26")
    least, most = solution.tip_v.min(), solution.tip_v.max()
    assert tip.startswith(f"tip     v from {least:.6g} m at ")
    assert f"to {most:.6g} m at " in tip


def test_a_run_starts_and_writes_as_the_file_says(config, tmp_path, capsys):
    meshio = pytest.importorskip("meshio")
    path = config(
        "[run]\nu = 1e-4\nv = [0.1, 0.3]\ntheta_rate = 0.2\nphi1 = 0.3\nomega = 1\n"
        't_span = [1, 1.01]\nstep = 1e-3\nmethod = "gauss4"\nevery = 5\n'
        '[output]\nformats = ["vtk"]\nfigures = false\n',
        paper(damping=(0.05, 0.0)).to_toml(),
    )
    cli.main(["beam", str(path), "--output", str(tmp_path / "out")])
    beam = models.RotatingBeam.from_toml(path)
    z0 = beam.state(u=1e-4, v=[0.1, 0.3], theta_rate=0.2, phi1=0.3, omega=1.0)
    solution = spim.integrate(beam, z0, (1.0, 1.01), 1e-3, method="gauss4", every=5)
    printed = capsys.readouterr().out.splitlines()
    assert printed[0] == str(tmp_path / "out" / "vtk" / "beam.pvd")
    assert "; balance error at most " in printed[4]
    assert [file.name for file in (tmp_path / "out").iterdir()] == ["vtk"]
    entries = collection(Path(printed[0]))
    assert [t for t, _ in entries] == [1.0, 1.005, 1.01]
    for (_, file), frame in zip(entries, solution.frames(), strict=True):
        assert np.array_equal(meshio.read(file).points[:, :2], frame)


RUN = "[run]\nt_span = [0.0, 0.01]\nstep = 1e-3\n"


def complaint(capsys, path, *arguments):
    """The one line that a bad file is answered with."""
    with pytest.raises(SystemExit) as stop:
        cli.main(["beam", str(path), *arguments])
    assert stop.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    return line


@pytest.mark.parametrize(
    ("run", "words"),
    [
        ("", "[run] t_span: is missing; give a pair of numbers (s: start and end)"),
        (RUN.replace("step", "stpe"), '[run] stpe: no such key; did you mean "step"?'),
        (RUN + 'v = "1 m"\n', "[run] v: must be a number or a list of numbers, got '1 m'"),
        (RUN + "v = [1, 2, 3]\n", "v: must be a number or have shape (2,), got (3,)"),
        (RUN + "phi2 = 0.1\n", "phi2: is not in the state, as the joint is locked"),
        (RUN.replace("1e-3", "-1e-3"), "[run] step: must be positive"),
        (RUN + 'method = "sark2"\n', "[run] unknown method 'sark2'"),
        (RUN + '[output]\nformats = ["cvs"]\n', "[output] formats: no such choice as 'cvs'; did y"),
        (RUN + "[outputs]\n", '[outputs]: no such table; did you mean "output"?'),
    ],
)
def test_bad_files_are_answered_in_one_line(config, tmp_path, capsys, run, words):
    path = config(run)
    line = complaint(capsys, path, "--output", str(tmp_path / "out"))
    assert line.startswith(f"spim beam: error: {path}: {words}")


def test_files_that_cannot_be_read_or_written_are_named(config, tmp_path, capsys):
    gone = tmp_path / "gone.toml"
    line = complaint(capsys, gone)
    assert line == f"spim beam: error: cannot read {gone}: No such file or directory"
    (tmp_path / "file").write_text("in the way")
    line = complaint(capsys, config(RUN), "--output", str(tmp_path / "file"))
    assert line.startswith(f"spim beam: error: cannot write to {tmp_path / 'file'}: ")
    (tmp_path / "latin.toml").write_bytes(b"# \xe9\n")
    line = complaint(capsys, tmp_path / "latin.toml")
    assert line.endswith("latin.toml: no TOML: not UTF-8 at byte 2")


def test_missing_packages_are_answered_with_the_remedy(config, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "meshio", None)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    out = ["--output", str(tmp_path / "out")]
    path = config(RUN + '[output]\nformats = ["vtk"]\n')
    assert complaint(capsys, path, *out).endswith('pip install "spim[vtk]"')
    assert not (tmp_path / "out").exists()
    cli.main(["beam", str(config(RUN + "v = 0.1\n")), *out])
    assert 'no figures: figures need Matplotlib, which is not installed: pip install "spim[pl' in (
        capsys.readouterr().out
    )
    assert sorted(file.name for file in (tmp_path / "out").iterdir()) == ["beam.csv", "beam.npz"]


def test_an_uneven_span_is_said_in_one_line(config, tmp_path, capsys):
    path = config(RUN.replace("1e-3", "3e-3") + "[output]\nfigures = false\n")
    cli.main(["beam", str(path), "--output", str(tmp_path / "out")])
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("spim beam: the span 0.01 is no multiple of the step 0.003: equal ")


KANE = kane(coupling="foac").to_toml()
SPUN = "[run]\nt_span = [0, 15]\nstep = 1e-2\n[output]\nformats = ['csv']\nfigures = false\n"


def test_the_tip_of_the_spin_up_is_that_of_the_literature(config, tmp_path, capsys):
    """Kane, Ryan & Banerjee (1987): -0.574 m; -0.57440 m at 6.762 s in a converged run."""
    cli.main(["beam", str(config(SPUN, KANE)), "--output", str(tmp_path / "out")])
    tip = capsys.readouterr().out.splitlines()[-1]
    assert tip.startswith("tip     v from -0.57440")
    assert " m at 6.76 s to " in tip


def ended(capsys, path, folder):
    """The one line a run is answered with that did not get to its end, and what was printed."""
    with pytest.raises(SystemExit) as stop:
        cli.main(["beam", str(path), "--output", str(folder)])
    assert stop.value.code == 1
    printed, complaints = capsys.readouterr()
    # A warning may come before.
    *_, line = complaints.splitlines()
    return line, printed


def test_a_run_that_ends_early_writes_what_it_has(config, tmp_path, capsys):
    """RK4 beyond h w_max = 2.828."""
    path = config(SPUN.replace("[output]", 'method = "rk4"\n[output]'), KANE)
    line, printed = ended(capsys, path, tmp_path / "out")
    assert line.startswith("spim beam: the run ended early: rk4: component ")
    steps = int(printed.split("steps   ")[1].split()[0])
    assert 0 < steps < 1500
    assert len(table(tmp_path / "out" / "beam.csv")[1]) == steps + 1


def test_a_run_beyond_its_coupling_says_which_goes_further(config, tmp_path, capsys):
    """A deflection of half the length, beyond coupling of first order."""
    run = "[run]\nv = [2, 4]\nt_span = [0, 2]\nstep = 1e-2\n[output]\nformats = []\nfigures = false"
    line, printed = ended(capsys, config(run), tmp_path / "out")
    assert 'coupling="third" goes further' in line
    assert int(printed.split("steps   ")[1].split()[0]) > 10
