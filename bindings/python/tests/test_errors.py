"""Errors are ValueError and OSError with the library's messages; Ctrl-C and threads work."""

import copy
import itertools
import os
import signal
import subprocess
import sys
import textwrap
import threading
import time

import pytest
import seaplant as sp


def test_a_missing_file_is_a_file_not_found(tmp_path):
    for action in (sp.Vehicle, sp.identify_campaign, sp.Log.open):
        with pytest.raises(FileNotFoundError, match="cannot read .*nowhere") as caught:
            action(tmp_path / "nowhere")
        assert isinstance(caught.value, sp.FileError)


def test_messages_are_those_of_the_library(campaign, command_line, tmp_path):
    broken = tmp_path / "campaign.toml"
    broken.write_text(campaign.read_text().replace("[[trial]]", "[[trail]]"))
    with pytest.raises(ValueError, match="did you mean `trial`") as caught:
        sp.identify_campaign(broken)
    with pytest.raises(subprocess.CalledProcessError) as refused:
        command_line("identify", broken)
    assert str(caught.value).splitlines()[-1] in refused.value.stderr


def test_wrong_settings_are_refused_with_the_near_one(dive):
    with pytest.raises(sp.InputError, match="did you mean `velocity_filter`"):
        sp.identify(dive.trials, dive.vehicle, equation_error={"velocity_filtre": {}})
    with pytest.raises(sp.InputError, match="unknown method `filter-eror`"):
        sp.identify(dive.trials, dive.vehicle, "filter-eror")
    with pytest.raises(sp.InputError, match="do not make a plant model"):
        sp.identify(dive.trials, dive.vehicle, terms="force,bias")
    with pytest.raises(sp.InputError, match="did you mean `duration_s`"):
        sp.twin(duration=3.0)
    with pytest.raises(sp.InputError, match="it must be"):
        sp.twin(duration_s=-3.0)


def test_arguments_of_another_kind_are_refused_with_what_to_give(dive):
    fit = sp.identify(dive.trials, dive.vehicle, "equation-error")
    table = {"time": [0.0, 1.0], "velocity.surge [m/s]": [0.0, 1.0]}
    for action, words in [
        (lambda: sp.identify(dive.trials, None), "vehicle must be a Vehicle, found NoneType"),
        (
            lambda: sp.identify(None, dive.vehicle),
            "trials must be a Trial or several, found None",
        ),
        (lambda: sp.identify(["surge"], dive.vehicle), "each of the trials must be a Trial"),
        (lambda: sp.steady_drag(3), "found int; make one with seaplant.Trial"),
        (lambda: fit.validate("campaign.toml"), "found str; make one with seaplant.Trial"),
        (lambda: sp.Trial(table, "vehicle.toml", "surge"), "make one with seaplant.Vehicle"),
        (lambda: sp.Controller(fit, {"surge": 0.1}), r"found Fit; use fit\.plant\(\)"),
        (lambda: sp.PlantEstimator(dive.vehicle, "surge").fit([1.0]), "found float; make one"),
    ]:
        with pytest.raises(sp.InputError, match=words):
            action()


def test_trials_of_one_name_are_refused(dive):
    with pytest.raises(sp.InputError, match="`surge 1`: is given twice"):
        sp.identify([dive.trials[0], dive.trials[0]], dive.vehicle)


def test_nothing_identified_says_why(dive):
    with pytest.raises(sp.InputError, match=r"no plant could be identified:\n  no trial has"):
        sp.identify(dive.trials[1], dive.vehicle)


def test_other_threads_run_while_the_library_works(dive):
    beats = []
    stop = threading.Event()

    def beat():
        while not stop.wait(0.001):
            beats.append(time.perf_counter())

    beating = threading.Thread(target=beat)
    beating.start()
    try:
        sp.monte_carlo(dive_spec(), method="filter-error", runs=4, threads=1)
    finally:
        stop.set()
        beating.join()
    pauses = [later - sooner for sooner, later in itertools.pairwise(beats)]
    assert len(beats) > 20
    # A held lock would stop the clock for complete fits; half a second allows for a busy
    # machine.
    assert max(pauses) < 0.5


def dive_spec():
    return {"dofs": ["surge"], "duration_s": 240.0}


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for one process")
def test_ctrl_c_ends_the_wait_at_once():
    program = """
        import seaplant as sp, time
        print("ready", flush=True)
        started = time.perf_counter()
        try:
            sp.monte_carlo(runs=10_000)
        except KeyboardInterrupt:
            print(time.perf_counter() - started, flush=True)
    """
    words = [sys.executable, "-c", textwrap.dedent(program)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        time.sleep(1.0)
        process.send_signal(signal.SIGINT)
        waited = float(process.stdout.readline())
        process.wait(timeout=60)
    assert waited < 3.0


def test_settings_are_checked_before_anything_is_fitted(dive):
    filters = {"term_filter": {"cutoff_hz": -1.0, "order": 2}}
    words = r"equation-error.term_filter.cutoff_hz: is -1; it must be above 0"
    with pytest.raises(sp.InputError, match=words):
        sp.identify(dive.trials, dive.vehicle, equation_error=filters)
    clock = sp.ShardClock.of(dive.trials[0])
    with pytest.raises(sp.InputError, match="term_filter.cutoff_hz is -1"):
        sp.Shards.of(dive.trials[0], clock, equation_error=filters)
    with pytest.raises(sp.InputError, match="resamples: is 10; it must be from 100"):
        sp.identify(dive.trials, dive.vehicle, equation_error={"bootstrap": {"resamples": 10}})


def test_an_attribute_that_is_not_there_is_answered_with_what_is(dive):
    fit = sp.identify(dive.trials, dive.vehicle, "equation-error")
    for action, words in [
        (lambda: fit.surge, r"Fit has no `surge`; did you mean \['surge'\]\? it has caveats, "),
        (lambda: fit.plnats, r"did you mean \.plants\?"),
        (
            lambda: fit["surge"].mass,
            r"PlantResult has no `mass`; did you mean \.by_axis\['surge'\]\.mass",
        ),
        (lambda: dive.trials[0].velocity, "Trial has no `velocity`; "),
        (lambda: dive.vehicle.zzz, "Vehicle has no `zzz`; it has "),
    ]:
        with pytest.raises(AttributeError, match=words) as caught:
            action()
        assert isinstance(caught.value, sp.InputError)
    assert not hasattr(fit, "surge")
    # Python's own lookups get Python's own errors.
    assert copy.deepcopy(fit["surge"]) == fit["surge"]
    assert not hasattr(fit, "_repr_svg_")
