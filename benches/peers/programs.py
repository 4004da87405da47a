"""The compared programs: each runs one problem once and returns cost and results."""

import csv
import json
import pathlib
from dataclasses import dataclass
from typing import Optional

import measure

HERE = pathlib.Path(__file__).resolve().parent
MODELS = HERE.parent / "problems"


@dataclass(frozen=True)
class Outcome:
    """One run of one program on one problem."""

    cpu: float  # seconds, the whole process
    solver_cpu: float  # seconds, the solver alone
    peak_mb: float
    points: int  # points of a branch, or periods
    curves: dict  # coordinate, from 0 -> (frequencies, half peak-to-peak)
    states: tuple = ()  # Poincare points of the first periods


@dataclass(frozen=True)
class Peer:
    """Another program: a script of this folder, run by the Python of the virtual environment."""

    label: str
    python: pathlib.Path
    script: str
    model: str
    options: tuple

    @property
    def executable(self):
        """The executable, independent of the problem."""
        return self.script

    def run(self, folder):
        """One run; the script measures its solver itself, imports and compilation left out."""
        out = folder / "out.json"
        command = [self.python, HERE / self.script, MODELS / self.model, out, *self.options]
        usage = measure.run(command, folder)
        result = json.loads(out.read_text(encoding="utf-8"))
        amplitudes = enumerate(result.get("half_peak_to_peak", ()))
        return Outcome(
            cpu=usage.cpu,
            solver_cpu=result["solver_cpu"],
            peak_mb=usage.peak_mb,
            points=result["points"],
            curves={i: (result["omega"], amplitude) for i, amplitude in amplitudes},
            states=tuple(result.get("states", ())),
        )


@dataclass(frozen=True)
class GearlashResponse:
    """`gearlash` on a frequency response, with everything it does: stability, events, tables, figure, page."""

    label: str
    binary: pathlib.Path
    model: str
    interrupt_after: Optional[float] = None

    @property
    def executable(self):
        """The executable, independent of the problem."""
        return self.binary

    def run(self, folder):
        """One run; the solver's share is what a run that stops at its second point does not need."""
        command = gearlash(self.binary, self.model, folder)
        cut = measure.run([*command, "--set", "analyses.fr.max_points=2"], folder, accepted=(1,))
        accepted = (0,) if self.interrupt_after is None else (0, 1, 130)
        usage = measure.run(command, folder, accepted, self.interrupt_after)
        with open(folder / "results" / "fr.csv", encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        return Outcome(usage.cpu, usage.cpu - cut.cpu, usage.peak_mb, len(rows), curves(rows))


def curves(rows):
    """Half peak-to-peak of every connection against the frequency, from the rows of `fr.csv`."""
    names = [key[len("max."):] for key in rows[0] if key.startswith("max.")]
    omega = [float(row["omega"]) for row in rows]
    return {
        i: (omega, [0.5 * (float(row[f"max.{name}"]) - float(row[f"min.{name}"])) for row in rows])
        for i, name in enumerate(names)
    }


@dataclass(frozen=True)
class GearlashMap:
    """`gearlash` on Poincare points from rest."""

    label: str
    binary: pathlib.Path
    model: str
    periods: int

    @property
    def executable(self):
        """The executable, independent of the problem."""
        return self.binary

    def run(self, folder):
        """One run that writes all points; the solver's share from two more that write one point.

        A long run that only integrates, less one of a single period: divided by the length, what a period costs.
        """
        length = 10 * self.periods
        long, short = (self.measure(folder, transient=n, periods=1) for n in (length, 0))
        usage = self.measure(folder, transient=0, periods=self.periods)
        with open(folder / "results" / "pm.csv", encoding="utf-8", newline="") as file:
            rows = list(csv.reader(file))[1:]
        states = tuple([float(number) for number in row[2:]] for row in rows[:20])
        solver = (long.cpu - short.cpu) * self.periods / length
        return Outcome(usage.cpu, solver, usage.peak_mb, len(rows), {}, states)

    def measure(self, folder, transient, periods):
        """Usage of one run over `transient` + `periods` periods."""
        settings = {"transient": transient, "periods": periods}
        changes = [word for key, value in settings.items() for word in ("--set", f"analyses.pm.{key}={value}")]
        return measure.run([*gearlash(self.binary, self.model, folder), *changes], folder)


def gearlash(binary, model, folder):
    """The command that runs a model on one core."""
    return [binary, "run", MODELS / model, "--jobs", "1", "--quiet", "--out", folder / "results"]
