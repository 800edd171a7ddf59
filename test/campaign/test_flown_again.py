"""A case flown again alone, on the node graph, has the bits of the case in-process and the figures of the data set."""

import pytest

from formation_gnc.analysis.compare import gnc_topics
from formation_gnc.campaign.dataset import Dataset
from formation_gnc.campaign.definition import load_campaign
from formation_gnc.campaign.version import software_version
from formation_gnc.campaign.worker import fly_range
from formation_gnc.cli import main
from formation_gnc.recording import Bag, identical


@pytest.mark.sil
@pytest.mark.usefixtures("without_pictures")
def test_a_case_on_the_graph_has_the_bits_of_the_campaign(write, small, tmp_path, capsys):
    path = write(small)
    campaign, results = load_campaign(path), Dataset(tmp_path / "results")
    results.create(campaign, software_version(), "", 6)
    fly_range(str(results.directory), campaign.identity, software_version(), (0, 3))
    bags = [tmp_path / "process", tmp_path / "graph"]
    for bag, where in zip(bags, ([], ["--on-graph"]), strict=True):
        words = ["campaign", str(path), "--only", "2", "--out", str(results.directory), "--bag", str(bag), *where]
        assert main(words) == 0
        assert "figures are those of" in capsys.readouterr().err
    pair = [Bag(bag) for bag in bags]
    assert not identical(*pair, gnc_topics(*pair))
