"""The map of a run is found from its folder, wherever a command is called."""

import numpy as np

import desim


def test_the_map_of_a_run_is_found_from_anywhere(tmp_path, monkeypatch):
    pixels = np.full((60, 60), 254, np.uint8)
    pixels[[0, -1]] = pixels[:, [0, -1]] = 0
    (tmp_path / "flat.pgm").write_bytes(b"P5\n60 60\n255\n" + pixels.tobytes())
    (tmp_path / "flat.yaml").write_text("image: flat.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n"
                                        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n")
    (tmp_path / "mine.yaml").write_text(
        "name: mine\nenvironment: {terrain: {map: flat.yaml}}\n"
        "fleet: {size: 1, start: {from: [3 m, 3 m], step: [1 m, 0 m]}}\nstop: {elapsed: 1 s}\n")
    finished = desim.run(desim.load(tmp_path / "mine.yaml"), out=tmp_path / "results")
    monkeypatch.chdir("/")
    assert desim.Run(finished.path).scenario.environment.terrain.map == str(tmp_path / "flat.yaml")
