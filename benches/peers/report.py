"""The figures of a comparison as Markdown."""

from statistics import median

from measure import PeersError

BEGIN, END = "<!-- peers: begin -->", "<!-- peers: end -->"

NOTES = """\
CPU seconds (user and system) on one core, {runs}. Ratios to `gearlash` compare runs made one after the other.
*Whole process*: from the start of the command to its end. This includes start-up, compilation (most of it in numbalsoda), reading the
file and writing the results. *Solver*: the solver alone. On P1 and P2 `gearlash` computes Floquet multipliers at every point
and locates folds and bifurcations; pyHarm has no stability analysis. On P3 and P13 `gearlash` integrates with a local error of 1e-12.
*Error*: relative error of the maxima (P1, P2); error of the state after ten periods (P3; P13, over half the gap)."""


def document(results, hardest, surroundings, runs):
    """The whole text: what ran where, the table, notes."""
    words = "one run" if runs == 1 else f"medians of {runs} runs"
    parts = [*surroundings, "", *table(results), "", NOTES.format(runs=words)]
    scaled = [o for case, outcomes in results if case.periods for o in outcomes if o[0].points != case.periods]
    if scaled:
        parts.append(f"scipy's rows of P3 and P13 are extrapolated from {scaled[0][0].points} periods.")
    if hardest is not None:
        parts += ["", *hard_table(*hardest)]
    return "\n".join(parts) + "\n"


def table(results):
    """Rows of the main table; `results`: pairs of a case and the outcomes of every entry, one per run."""
    yield "| Problem | Program | Points | Whole process, s | ratio | Solver, s | ratio | Peak, MB | Error |"
    yield "|---|---|--:|--:|--:|--:|--:|--:|--:|"
    for case, outcomes in results:
        ours = outcomes[0]
        for entry, runs in zip(case.entries, outcomes):
            whole = [scaled(case, run)[0] for run in runs]
            solver = [scaled(case, run)[1] for run in runs]
            cells = (
                f"{case.name}: {case.title}" if entry is case.entries[0] else "",
                entry.program.label,
                str(case.periods or runs[0].points),
                figures(median(whole)),
                ratio(whole, [scaled(case, run)[0] for run in ours]),
                solver_cell(case, median(solver)),
                ratio(solver, [scaled(case, run)[1] for run in ours]),
                f"{max(run.peak_mb for run in runs):.0f}",
                f"{max(check.error(run) for check in entry.checks for run in runs):.0e}",
            )
            yield f"| {' | '.join(cells)} |"


def hard_table(case, outcomes):
    """Rows of the table of P2b: the lowest frequency that each program reached."""
    yield f"{case.name}: {case.title}."
    yield ""
    yield "| Program | Points | Lowest frequency | Whole process, s | Peak, MB |"
    yield "|---|--:|--:|--:|--:|"
    for entry, (run,) in zip(case.entries, outcomes):
        lowest = min(run.curves[0][0])
        yield f"| {entry.program.label} | {run.points} | {lowest:.4f} | {figures(run.cpu)} | {run.peak_mb:.0f} |"


def scaled(case, run):
    """CPU seconds of whole process and solver, of integrations scaled to the periods of the case."""
    factor = case.periods / run.points if case.periods else 1.0
    solver = run.solver_cpu * factor
    return run.cpu - run.solver_cpu + solver if factor != 1.0 else run.cpu, solver


def solver_cell(case, seconds):
    """Seconds; for integrations also microseconds per period."""
    if case.periods is None:
        return figures(seconds)
    return f"{figures(seconds)} ({figures(1e6 * seconds / case.periods)} µs per period)"


def ratio(theirs, ours):
    """Median of the ratios of runs made one after the other."""
    return f"{median(a / b for a, b in zip(theirs, ours)):.3g}"


def figures(seconds):
    """Three figures, without exponent."""
    digits = 0 if seconds >= 100 else 1 if seconds >= 10 else 2 if seconds >= 1 else 3
    return f"{seconds:.{digits}f}"


def replace(readme, text):
    """Puts `text` between the two marks of the file."""
    before, after = around_marks(readme)
    readme.write_text(f"{before}{BEGIN}\n{text}\n{END}{after}", encoding="utf-8")


def around_marks(readme):
    """What stands before and after the part of the file to be replaced; `PeersError` if it is not marked."""
    try:
        text = readme.read_text(encoding="utf-8")
    except OSError as error:
        raise PeersError(f"--readme {readme}: {error.strerror}") from error
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise PeersError(f"--readme {readme}: needs the line {BEGIN} and below it the line {END}")
    return before, after
