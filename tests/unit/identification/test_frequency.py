"""Tables over frequency: whatever the columns, the same response, and the planted order."""

import json

import numpy as np
import pytest

import pamsim
from pamsim.identification.frequency import identify_frequency_response
from pamsim.identification.frequency_table import frequency_response_of, is_over_frequency
from pamsim.identification.identify import identify
from pamsim.recordings.table_reader import read_columns
from tests.unit.identification.planted import refuses

W = np.geomspace(0.2, 80.0, 40)


def planted(zeros=1):
    """Two lags, and a zero or none, with independent relative errors of 2 %."""
    s, draw = 1j * W, np.random.default_rng(2).normal(size=(2, W.size))
    exact = 3.0 * (0.4 * s + 1.0) ** zeros / ((0.1 * s + 1.0) * (2.0 * s + 1.0))
    return exact * (1.0 + 0.02 * (draw[0] + 1j * draw[1]))


G = planted()
SIZE, PHASE = np.abs(G), np.angle(G)
HERTZ, TURNED, DECIBELS = W / (2.0 * np.pi), np.degrees(PHASE), 20 * np.log10(SIZE)


def text(header, *columns):
    rows = (",".join(map(repr, row)) for row in zip(*(c.tolist() for c in columns), strict=True))
    return "\n".join([header, *rows]) + "\n"


PLAIN = text("Frequency (Hz),Gain (dB),Phase (°)", HERTZ, DECIBELS, TURNED)
DIALECTS = {
    "hertz and decibels": text("frequency_hz,magnitude_db,phase_deg", HERTZ, DECIBELS, TURNED),
    "rad/s and ratio": text("omega_rad_s,magnitude,phase_rad", W, SIZE, PHASE + 2.0 * np.pi),
    "real and imaginary": text("f [kHz],Re,Im", 1e-3 * HERTZ, G.real, G.imag),
    "decimal commas": PLAIN.replace(",", ";").replace(".", ","),
    "no units, falling": text("w,mag,phase", W[::-1], SIZE[::-1], TURNED[::-1]),
    "a line of units": text("freq,mag,phase\nHz,dB,deg", HERTZ, DECIBELS, TURNED),
}


def test_every_dialect_gives_the_same_response(tmp_path):
    path = tmp_path / "bode.csv"
    for name, written in DIALECTS.items():
        path.write_text(written, encoding="utf-8")
        table = read_columns(path)
        assert is_over_frequency(table), name
        frequency, response, notes = frequency_response_of(table)
        np.testing.assert_allclose(frequency, W, rtol=1e-12, err_msg=name)
        np.testing.assert_allclose(response, G, rtol=1e-9, err_msg=name)
        assert len(notes) == (2 if name.startswith("no units") else 0), name


@pytest.mark.parametrize("zeros", [0, 1])
def test_the_planted_order_is_recommended(zeros, tmp_path):
    path, response = tmp_path / "bode.csv", planted(zeros)
    path.write_text(text("omega_rad_s,real,imag", W, response.real, response.imag))
    result = pamsim.identify(path)
    assert result.best == ("order_2_zeros_1" if zeros else "order_2")
    for name, value in (("K", 3.0), ("T1", 0.1), ("T2", 2.0)):
        assert result.shown[name].value == pytest.approx(value, rel=0.05)
    assert f"* {result.best}: fits 97." in result.summary()
    assert float(result.transfer_function().dcgain()) == pytest.approx(3.0, rel=0.05)
    columns = pamsim.table(result)
    gains = [
        v for v, name in zip(columns["value"], columns["parameter"], strict=True) if name == "K"
    ]
    assert gains == [fit["K"].value for fit in result.models.values()]
    model, measured = pamsim.plot(result).axes[1].get_lines()
    turned = np.interp(W, *model.get_data())
    np.testing.assert_allclose(measured.get_ydata(), turned, atol=6.0)  # deg; errors of 2 %
    files = result.save(tmp_path / "out")
    assert json.loads(files[0].read_text())["recommended"] == result.best
    rows = np.loadtxt(files[1], delimiter=",", skiprows=1)
    np.testing.assert_allclose(rows[:, 1], np.abs(response), rtol=1e-6)
    np.testing.assert_allclose(rows[:, 3], rows[:, 1], rtol=0.15)


def test_an_order_that_is_asked_for_is_the_only_one_and_a_trial_is_no_response(tmp_path):
    path = tmp_path / "bode.csv"
    path.write_text(DIALECTS["real and imaginary"])
    result = identify(path, order=2, zeros=1, dead_time="none")
    assert list(result.models) == ["order_2_zeros_1"]
    unlikely = identify(path, order=5, dead_time="none")
    assert unlikely.best == ""
    assert "no model can be trusted" in unlikely.reason
    refuses("`zeros` needs `order`", identify, path, zeros=1)
    refuses(r"`hold_out` is for trials; .*bode.csv is a frequency", identify, path, hold_out=0.3)
    refuses("is a frequency response, not a trial", identify, [path, path])
    path.write_text(text("omega_rad_s,magnitude,phase_deg", W, DECIBELS, TURNED))
    refuses("is negative; name the column magnitude_db", identify, path)
    path.write_text("time_s,magnitude,phase_deg\n1,2,3\n2,3,4\n")
    refuses("no frequency response: name columns", identify_frequency_response, read_columns(path))


@pytest.mark.parametrize("gain", [2.0, -0.5])
@pytest.mark.parametrize("noise", [0.0, 1e-12, 0.02])
def test_a_pure_gain_is_recommended_as_one(gain, noise, tmp_path):
    """Also of exact readings, whose residual is rounding and the same at every frequency."""
    draw = np.random.default_rng(1).normal(size=(2, W.size))
    response = gain * (1.0 + noise * (draw[0] + 1j * draw[1]))
    path = tmp_path / "bode.csv"
    path.write_text(text("omega_rad_s,real,imag", W, response.real, response.imag))
    for order in (None, 0):
        result = pamsim.identify(path, order=order)
        assert result.best == "order_0", result.reason
        assert result.shown["K"].value == pytest.approx(gain, rel=2.0 * max(noise, 1e-6))
        assert len(result.shown.poles) == 0
