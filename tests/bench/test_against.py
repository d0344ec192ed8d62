"""`pointshade bench --speed --against`: versions are timed in turn, commits unpacked, stored figures read."""

import json
import os
import subprocess

import pytest

from pointshade_gl.bench.command import research

against = research("against", "speed_against")

LAPS = [{"ms": 10.0, "cpu_ms": 20.0}, {"ms": 12.0, "cpu_ms": 24.0}, {"ms": 11.0, "cpu_ms": 22.0}]


@pytest.fixture
def repository(tmp_path, monkeypatch):
    """A checkout whose package has changed since its only commit."""
    package = tmp_path / "repository" / "pointshade_gl"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("version = 1\n")
    identity = ["-c", "user.name=test", "-c", "user.email=test@localhost"]
    for command in (["init", "-q"], ["add", "-A"], [*identity, "commit", "-qm", "first"]):
        subprocess.run(["git", *command], cwd=package.parent, check=True)
    (package / "__init__.py").write_text("raise ImportError('no version 2')\n")
    monkeypatch.setattr(against, "HERE", package.parent)
    return package.parent


def test_a_commit_is_unpacked_as_it_was(repository, tmp_path):
    against.check_out("HEAD", tmp_path / "before")
    assert (tmp_path / "before" / "pointshade_gl" / "__init__.py").read_text() == "version = 1\n"


@pytest.mark.parametrize("revision", ["nothing", "--all", "HEAD~1", "speed.json"])
def test_what_is_neither_file_nor_commit_is_told_with_the_option(repository, revision, tmp_path):
    with pytest.raises(ValueError, match=f"against {revision} is neither a file nor a commit of"):
        against.check_out(revision, tmp_path)


def test_outside_a_checkout_the_error_says_what_else_can_be_passed(tmp_path, monkeypatch):
    monkeypatch.setattr(against, "HERE", tmp_path)
    with pytest.raises(ValueError, match=r"against HEAD .* pass the speed\.json"):
        against.check_out("HEAD", tmp_path)


def test_a_version_that_does_not_run_is_named(repository):
    with pytest.raises(ValueError, match=r"old does not run here: ImportError: no version 2"):
        against.Worker(repository, 0, "old")


def test_a_version_finds_the_packages_that_this_one_finds(repository, monkeypatch, tmp_path):
    (tmp_path / "beside.py").write_text("raise ImportError('beside is found')\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    (repository / "pointshade_gl" / "__init__.py").write_text("import beside\n")
    with pytest.raises(ValueError, match="new does not run here: ImportError: beside is found"):
        against.Worker(repository, 0, "new")


@pytest.mark.gl
def test_versions_are_timed_and_a_job_that_one_cannot_do_is_left_out(renderer, monkeypatch):
    monkeypatch.setattr(against, "JOBS", ("new view", "new invention"))
    times = against.race({"a": against.HERE, "b": against.HERE}, 0, 2, lambda: None)
    assert set(times) == {"a", "b"}
    for of_version in times.values():
        assert len(of_version["new view"]) == 2 and of_version["new invention"] == []
        assert all(lap["ms"] > 0 and lap["cpu_ms"] > 0 for lap in of_version["new view"])


def test_ratios_are_those_of_now_to_stored_figures(tmp_path, monkeypatch, capsys):
    stored = tmp_path / "speed.json"
    stored.write_text(json.dumps({"jobs": {"new frame": {"ms": 22, "cpu_ms": 11}}}))
    monkeypatch.setattr(against, "race", lambda *_: {"this version": dict.fromkeys(against.JOBS, LAPS)})
    row, other = against.compare(str(stored), 0, 3, lambda: None)[:2]
    assert (row["before_ms"], row["now_ms"], row["ratio"], row["cpu_ratio"]) == (22, 11, 0.5, 2)
    assert other["before_ms"] is None and other["ratio"] is None
    said = against.bench_against(str(stored), True, 0)
    assert str(stored) in said and "0.50" in capsys.readouterr().out


def test_rounds_are_compared_one_by_one():
    twice = [{key: 2 * value for key, value in lap.items()} for lap in LAPS]
    row = against._row("new frame", LAPS, twice)
    assert row["ratio"] == 2 and row["spread"] == (2, 2)


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"jobs": {"new frame": 3}}', '{"jobs": []}'])
def test_a_file_without_speeds_is_told(tmp_path, content):
    (tmp_path / "a.json").write_text(content)
    with pytest.raises(ValueError, match=r"against: .*a\.json holds no speeds"):
        against.read_jobs(tmp_path / "a.json")
