import pytest

from thermospindle.diagnosis.decision import explanations


@pytest.fixture(autouse=True)
def by_evidence_alone(monkeypatch):
    """Probabilities as evidence has them: how often that is led astray is `test_astray`'s alone."""
    monkeypatch.setattr(explanations, "ASTRAY", 0.0)
