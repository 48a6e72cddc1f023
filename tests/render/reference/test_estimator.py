"""The reference renderer as a program: it stops, resumes, is deterministic, and reports what it computed."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from flarewright.errors import OutputError, ProjectError
from flarewright.io.render_state.reference_state import read_reference_state, write_reference_state
from flarewright.model import BlackBody, Camera, Imperfection, Iris, Light, Output, Project, Quality, Scatter, Surface
from flarewright.optics.colour.rgb import luminance_weights
from flarewright.render.reference import energy_ledger as ledger_pass
from flarewright.render.reference import estimator as reference_pass
from flarewright.render.reference.estimator import LEAST_BATCHES, ReferenceRun
from flarewright.render.render import render
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import load_lens, resolve_project
from flarewright.render.scene.shots import make_shots

SIDE = 32
BATCH = SIDE * SIDE
WARM = Light(field_deg=(-3.0, 6.0), intensity=0.3, spectrum=BlackBody(temperature_k=3000))
LIGHTS = (Light(field_deg=(8.0, 4.0)), WARM)


def project(**changes):
    # random rays have no rings, and ledgers ignore those of final quality
    quality = Quality(mode="reference", wavelengths=3, bridge=False, ringing="off", reference_samples=4 * BATCH)
    quality = quality.replace(**{k: v for k, v in changes.items() if k in Quality.model_fields})
    return Project(
        lens="triplet-pestrecov",
        lights=changes.get("lights", LIGHTS[:1]),
        camera=Camera(size_px=(40, 24)),
        iris=Iris(blades=6),
        output=Output(starburst=False),
        quality=quality,
    )


def same(one, other):
    assert [layer.name for layer in one.layers] == [layer.name for layer in other.layers]
    for a, b in zip(one.layers, other.layers, strict=True):
        np.testing.assert_array_equal(a.pixels, b.pixels)


def layer(rendering, name):
    return next(layer for layer in rendering.layers if layer.name == name).pixels


@pytest.fixture(scope="module", autouse=True)
def _small_batches():
    """Use 1/16 of the usual rays per batch: these tests are about bookkeeping."""
    patch = pytest.MonkeyPatch()
    patch.setattr(reference_pass, "SIDE", SIDE)
    yield
    patch.undo()


def smaller_batches(patch):
    """For what is kept and resumed a batch of any size will do."""
    patch.setattr(reference_pass, "SIDE", 16)


@pytest.fixture
def smaller(monkeypatch):
    smaller_batches(monkeypatch)


@pytest.fixture(scope="module")
def eight(_small_batches):
    with pytest.MonkeyPatch.context() as patch:
        smaller_batches(patch)
        return render(project(reference_samples=8 * 16 * 16, lights=LIGHTS), ledger=True, threads=1)


def test_layers(eight):
    names = [layer.name for layer in eight.layers]
    assert names == ["beauty", "ghosts", "ghosts.order4+", "ghosts.variance", "ghosts.order4+.variance"]
    np.testing.assert_array_equal(layer(eight, "beauty"), layer(eight, "ghosts") + layer(eight, "ghosts.order4+"))
    assert layer(eight, "ghosts").shape == (24, 40, 3)
    assert (layer(eight, "ghosts.variance") >= 0.0).all()
    assert layer(eight, "ghosts.variance").any()
    facts = eight.summary["reference"]
    assert (facts["batches"], facts["stopped_by"]) == (8, "samples")
    assert 0.0 < facts["share_of_four_and_more_reflections"] < 0.2


def test_pixels_do_not_depend_on_threads(eight, smaller):
    same(eight, render(eight.project, threads=3))


def test_resumed_is_the_same_bit_for_bit(eight, smaller, tmp_path):
    file = tmp_path / "a.state.npz"
    three = project(reference_samples=3 * 16 * 16, lights=LIGHTS)
    render(three, run=ReferenceRun(state_file=file))
    state = read_reference_state(file)
    assert (state.batches, state.project) == (3, three)
    same(eight, render(eight.project, run=ReferenceRun(resume=state, state_file=file)))
    assert read_reference_state(file).batches == 8


def test_interrupted_keeps_what_was_done(eight, smaller, tmp_path):
    file = tmp_path / "a.state.npz"
    seen = []

    def interrupt(part, what):
        seen.append((part, what))
        if len(seen) == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        render(eight.project, progress=interrupt, run=ReferenceRun(state_file=file))
    assert read_reference_state(file).batches == 5
    assert [part for part, _ in seen] == pytest.approx([k / 8 for k in range(1, 6)])
    same(eight, render(eight.project, run=ReferenceRun(resume=read_reference_state(file))))


def test_a_full_disk_costs_the_state_and_not_the_picture(eight, smaller, tmp_path, monkeypatch):
    def full(path, _state):
        raise OutputError(f"cannot write {path}: no space left on device")

    monkeypatch.setattr(reference_pass, "write_reference_state", full)
    drawn = render(eight.project, run=ReferenceRun(state_file=tmp_path / "a.state.npz"))
    same(eight, drawn)
    assert sum(f"cannot write {tmp_path / 'a.state.npz'}" in remark for remark in drawn.remarks) == 1


def test_another_seed_gives_other_rays_of_the_same_light():
    one, other = (render(project(reference_samples=LEAST_BATCHES * BATCH, seed=seed)) for seed in (0, 2**60 + 1))
    assert (layer(one, "ghosts") != layer(other, "ghosts")).any()
    a, b = (r.summary["reference"] for r in (one, other))
    noise = np.hypot(a["relative_standard_error"], b["relative_standard_error"])
    assert abs(a["ghost_flux_mm2"] / b["ghost_flux_mm2"] - 1.0) < 4.0 * noise < 0.1


def test_stops_at_the_wanted_error():
    loose, strict = (
        render(project(reference_samples=None, reference_error=e, reference_error_of=of)).summary["reference"]
        for e, of in ((0.5, "total"), (0.1, "blocks"))
    )
    assert (loose["batches"], loose["stopped_by"]) == (LEAST_BATCHES, "error")
    assert strict["relative_standard_error_of_blocks"] <= 0.1
    assert strict["stopped_by"] == "error"


def test_stops_when_the_time_is_over():
    rendering = render(project(reference_samples=None, reference_error=1e-5), run=ReferenceRun(time_limit_s=0.01))
    assert rendering.summary["reference"]["stopped_by"] == "time"
    assert any("the time ended the render" in remark for remark in rendering.remarks)


def test_variance_is_that_of_repeated_renders():
    """The scatter of 12 seeds equals the predicted error: chi-squared over pixels."""
    many = [render(project(wavelengths=1, reference_samples=8 * BATCH, seed=seed)) for seed in range(12)]
    means = np.array([layer(r, "ghosts")[..., 1] for r in many], dtype=np.float64)
    reported = np.mean([layer(r, "ghosts.variance")[..., 1] for r in many], axis=0)
    lit = reported > np.quantile(reported, 0.2)
    ratio = (means.var(axis=0, ddof=1)[lit] / reported[lit]).mean()
    # 11 degrees of freedom for each of 768 lit pixels: 0.08 is five standard deviations
    assert ratio == pytest.approx(1.0, abs=0.08)


def test_spectrum_in_fine_steps_or_as_final_traces_it():
    fine, coarse = (render(project(bridge=bridge, reference_samples=2 * BATCH)) for bridge in (True, False))
    sampled = np.array(fine.summary["reference"]["wavelengths_nm"])
    assert np.diff(sampled) == pytest.approx(5.0)
    assert sampled[0] < 365.0 < 775.0 < sampled[-1]
    assert coarse.summary["reference"]["wavelengths_nm"] == coarse.summary["wavelengths_nm"]


def test_a_state_of_other_settings_is_refused(tmp_path):
    file = tmp_path / "a.state.npz"
    render(project(reference_samples=2 * BATCH), run=ReferenceRun(state_file=file))
    state = read_reference_state(file)
    for other, word in (
        (project(seed=5), "seed"),
        (project(lights=LIGHTS), "light"),
        (project().replace(camera=Camera(size_px=(40, 25))), "picture"),
        (project().replace(imperfection=Imperfection(seed=1)), "lens"),
        (project().replace(f_number=8.0), "f-number"),
        (project().replace(iris=Iris(blades=5)), "iris"),
        (project(wavelengths=5), "spectral sampling"),
    ):
        with pytest.raises(ProjectError, match=f"another {word}; give the settings"):
            render(other, run=ReferenceRun(resume=state))


def test_damaged_states_are_errors(tmp_path):
    file = tmp_path / "a.state.npz"
    render(project(reference_samples=2 * BATCH), run=ReferenceRun(state_file=file))
    state = read_reference_state(file)
    write_reference_state(file, replace(state, batches=7))
    assert read_reference_state(file).batches == 7
    whole = file.read_bytes()
    for content in (whole[: len(whole) // 2], b"", b"no archive", whole.replace(b"sums.planes", b"sums.plenas")):
        file.write_bytes(content)
        with pytest.raises(ProjectError, match=r"state file of a reference render.*restart without --resume"):
            read_reference_state(file)
    with pytest.raises(ProjectError, match="does not exist"):
        read_reference_state(tmp_path / "b.npz")
    with pytest.raises(ProjectError, match="is a folder; give the state file"):
        read_reference_state(tmp_path)


def test_a_state_of_another_version_is_an_error(tmp_path, monkeypatch):
    file = tmp_path / "a.state.npz"
    monkeypatch.setattr("flarewright.io.render_state.reference_state.__version__", "0.0.9")
    render(project(reference_samples=2 * BATCH), run=ReferenceRun(state_file=file))
    monkeypatch.undo()
    with pytest.raises(ProjectError, match=r"version 0\.0\.9"):
        read_reference_state(file)


# ---------------------------------------------------------------------------------------------------------------------
# The ledger


BROADBAND = """
from flarewright.model import Camera, Everywhere, Light, Project, Quality, Standard
from flarewright.render.render import render

broadband = Everywhere(coating=Standard(name="modern-broadband"))
for lens in ("heliar-tronnier", "double-gauss-tronnier"):
    made = Project(
        lens=lens, coating=broadband, lights=(Light(field_deg=(12.0, 5.0)),), f_number=5.6,
        camera=Camera(size_px=(16, 9)), quality=Quality(mode="draft", wavelengths=3),
    )
    found = render(made, ledger=True).summary["ledger"]
    assert abs(found["sum"] - 1.0) < 1e-3, found
"""


def test_a_fine_coating_sends_no_ray_around_for_ever(monkeypatch):
    """The same with few rays, in this process."""
    monkeypatch.setattr(ledger_pass, "SIDE", 24)
    # a ledger ignores the starburst
    small = BROADBAND.replace("wavelengths=3)", "wavelengths=1), output=Output(starburst=False)")
    small = small.replace("Light, Project", "Light, Output, Project")
    exec(small.replace('("heliar-tronnier", "double-gauss-tronnier")', '("double-gauss-tronnier",)'), {})


@pytest.mark.slow
def test_oblique_rays_through_fine_coatings_do_not_breed_without_end():
    """At 60 degrees such a coating reflects 25 times as much as at normal incidence; a tree of rays must end."""
    subprocess.run([sys.executable, "-c", BROADBAND], check=True, timeout=300)


@pytest.mark.parametrize("mode", ["final", "reference"])
def test_ledger_sums_to_one(mode, monkeypatch):
    monkeypatch.setattr(ledger_pass, "SIDE", SIDE)
    rendering = render(project(mode=mode, lights=LIGHTS, wavelengths=1 if mode == "final" else 3), ledger=True)
    ledger = rendering.ledger
    assert sum(line.share for line in ledger.lines) == pytest.approx(ledger.total.share, abs=1e-12)
    assert ledger.total.share == pytest.approx(1.0, abs=1e-3)
    assert abs(ledger.total.share - 1.0) < 5.0 * ledger.total.standard_error < 1e-3
    assert rendering.summary["ledger"]["sum"] == ledger.total.share
    shares = rendering.summary["ledger"]["shares"]
    assert len(shares) == 12
    assert all(share >= 0.0 for share in shares.values())


@pytest.mark.parametrize("mode", ["reference", pytest.param("final", marks=pytest.mark.slow)])
def test_scatter_has_its_lines_in_the_ledger(mode, monkeypatch):
    """Six surfaces that scatter 2 % each leave 0.98^6 of the direct light."""
    monkeypatch.setattr(ledger_pass, "SIDE", 32)
    plain = render(project(mode=mode, wavelengths=1), ledger=True).summary["ledger"]
    dusty = project(mode=mode, wavelengths=1).replace(scatter=Scatter(model="chaumond", share=0.02))
    ledger = render(dusty, ledger=True).summary["ledger"]
    clear, shares = plain["shares"], ledger["shares"]
    surfaces = sum(isinstance(row, Surface) for row in load_lens("triplet-pestrecov").rows)
    direct, left = (light["direct.in_picture"] + light["direct.beside"] for light in (clear, shares))
    assert direct > 0.1
    assert left == pytest.approx(direct * 0.98**surfaces, rel=0.05)
    assert ledger["sum"] == pytest.approx(1.0, abs=1e-3)
    assert set(shares) - set(clear) == {"scatter.in_picture", "scatter.beside", "scatter.ended"}
    assert ledger["standard_errors"]["scatter.ended"] > 0.0


def test_ledger_agrees_with_final_quality():
    """Direct light and two-reflection ghosts, as final quality measures them."""
    final = render(project(mode="final", wavelengths=1))
    reference = render(project(wavelengths=1, reference_samples=128 * BATCH, reference_error=1e-5), ledger=True)
    ledger = reference.ledger
    shares = {line.name: (line.share, line.standard_error) for line in ledger.lines}
    settled = resolve_project(final.project)
    shot = make_shots(settled, make_opening(settled, None))[0]
    luminance = luminance_weights("rec709")
    per_wavelength = shot.weights(shot.packed.wavelengths_nm) @ luminance
    direct = float(per_wavelength @ np.array(final.summary["lights"][0]["direct_throughput_mm2"]))
    ghosts = float((layer(final, "ghosts").astype(np.float64) @ luminance).sum() * (36.0 / 40) ** 2)
    for drawn, name in ((direct, "direct.in_picture"), (ghosts, "ghosts.order2.in_picture")):
        got, error = (value * ledger.entered_mm2 for value in shares[name])
        # final quality states an error of 0.2 %
        assert drawn == pytest.approx(got, abs=4.0 * error + 2e-3 * got)
        assert error < 4e-3 * got
    assert shares["direct.beside"][0] == 0.0


def test_no_ledger_unless_asked():
    rendering = render(project(reference_samples=2 * BATCH))
    assert rendering.ledger is None
    assert "ledger" not in rendering.summary
