#!/usr/bin/env python3
"""`gearlash` compared with alternative tools on the problems of `benches/problems`.

Creates a virtual environment with the other programs, interleaves runs of all programs, cross-checks the answers
and prints CPU seconds and their ratios as a Markdown table. See the README in this folder.

Exit status: 0: all answers agree, 1: an answer is wrong, 2: the comparison could not be made.
"""

import argparse
import os
import pathlib
import sys
import tempfile

sys.dont_write_bytecode = True

import cases
import report
import surroundings
from measure import PeersError

PROJECT = pathlib.Path(__file__).resolve().parents[2]
PROBLEMS = ("P1", "P2", "P3", "P13")
# The other programs and the problems they take part in.
PEERS = {"pyharm": {"P1", "P2"}, "numbalsoda": {"P3", "P13"}, "scipy": {"P3", "P13"}}


def main():
    """Exit status of the comparison."""
    arguments = parse()
    try:
        return compare(arguments)
    except PeersError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130


def parse():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add = parser.add_argument
    add("--gearlash", type=pathlib.Path, metavar="PATH",
        help="the program [default: target/release/gearlash, built if missing]")
    add("--venv", type=pathlib.Path, default=PROJECT / "target" / "peers-venv", metavar="PATH",
        help="virtual environment of the other programs, created if missing [default: target/peers-venv]")
    add("--python", default=sys.executable, metavar="PATH", help="Python for the virtual environment [default: this one]")
    add("--without", action="append", default=[], choices=PEERS, help="omit a program (repeatable)")
    add("--only", action="append", choices=PROBLEMS, help="run only this problem (repeatable)")
    add("--runs", type=positive, metavar="N", help="number of runs of every program on every problem [default: 3]")
    add("--periods", type=positive, metavar="N", help="length of P3 and P13 [default: 20000]")
    add("--p2b", type=positive, metavar="SECONDS", help="also run P2b, with this time limit per program")
    add("--quick", action="store_true", help="one run of P1 and of 2000 periods of P3 and P13 only")
    add("--output", type=pathlib.Path, metavar="FILE", help="also write the table to this file")
    add("--readme", type=pathlib.Path, metavar="FILE", help="replace the text between the marks in this file")
    arguments = parser.parse_args()
    runs, periods, only = (1, 2000, ("P1", "P3", "P13")) if arguments.quick else (3, 20000, PROBLEMS)
    arguments.runs = arguments.runs or runs
    arguments.periods = arguments.periods or periods
    arguments.only = arguments.only or only
    return arguments


def positive(text):
    """A positive whole number, for the command line."""
    number = int(text)
    if number < 1:
        raise ValueError(text)
    return number


def compare(arguments):
    """Exit status: prepares, runs everything, prints."""
    if not hasattr(os, "wait4"):
        raise PeersError("CPU seconds of children are measured with os.wait4, which this system lacks")
    check_destinations(arguments)
    peers = taking_part(arguments)
    gearlash = surroundings.binary(arguments.gearlash, PROJECT)
    python = surroundings.prepare(arguments.venv.resolve(), arguments.python, peers)
    say(surroundings.load_warning())
    warm = set()
    results = [(case, alternate(case, arguments.runs, warm)) for case in chosen(arguments, gearlash, python, peers)]
    hardest = None
    if arguments.p2b:
        case = cases.hard_chain(gearlash, python, peers, arguments.p2b)
        hardest = case, alternate(case, 1, warm)
    lines = [f"{surroundings.machine()}; {surroundings.versions(python, gearlash, peers)}."]
    text = report.document(results, hardest, lines, arguments.runs)
    publish(text, arguments)
    return judge(results)


def taking_part(arguments):
    """The other programs that have something to do."""
    return [
        peer
        for peer, problems in PEERS.items()
        if peer not in arguments.without and (problems & set(arguments.only) or arguments.p2b and peer == "pyharm")
    ]


def check_destinations(arguments):
    """Raises `PeersError` now rather than after minutes if the text cannot be written where it was asked for."""
    if arguments.readme:
        report.around_marks(arguments.readme)
    if arguments.output and not arguments.output.resolve().parent.is_dir():
        raise PeersError(f"--output {arguments.output}: there is no such folder")


def chosen(arguments, gearlash, python, peers):
    """The cases asked for."""
    yield from cases.responses(gearlash, python, peers, arguments.only)
    if "P3" in arguments.only:
        yield cases.attractor(gearlash, python, peers, arguments.periods)
    if "P13" in arguments.only:
        yield cases.gear_pair(gearlash, python, peers, arguments.periods)


def alternate(case, runs, warm):
    """Outcomes of every entry: `runs` rounds, in each of which every program runs once.

    Programs not in `warm` run once before, not counted: pyHarm compiles at its first run and keeps the result.
    """
    programs = [entry.program for entry in case.entries]
    for program in programs:
        if program.executable not in warm:
            warm.add(program.executable)
            once(case, program, ", not counted")
    rounds = [[once(case, program) for program in programs] for _ in range(runs)]
    return list(zip(*rounds))


def once(case, program, remark=""):
    """Outcome of one run in an empty folder."""
    with tempfile.TemporaryDirectory(prefix="peers-") as folder:
        outcome = program.run(pathlib.Path(folder))
    say(f"{case.name} {program.label}: {outcome.cpu:.3f} s{remark}")
    return outcome


def publish(text, arguments):
    """Prints the text and writes it where it was asked for."""
    print(text, end="")
    if arguments.output:
        arguments.output.write_text(text, encoding="utf-8")
    if arguments.readme:
        report.replace(arguments.readme, text)


def judge(results):
    """Exit status 1 if any run of any program found something else, each said on stderr."""
    wrong = [
        f"{case.name}, {entry.program.label}: {sentence}"
        for case, outcomes in results
        for entry, runs in zip(case.entries, outcomes)
        for check in entry.checks
        for sentence in dict.fromkeys(s for run in runs for s in check.disagreements(run))
    ]
    for sentence in wrong:
        print(f"disagreement: {sentence}", file=sys.stderr)
    return 1 if wrong else 0


def say(sentence):
    """Progress and warnings, on stderr."""
    if sentence is not None:
        print(sentence, file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
