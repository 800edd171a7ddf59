"""A short run of `make fuzz`: no input of any part ends in an error that its reader does not document."""

from tools.fuzz import LONGEST, fuzz


def test_no_input_ends_in_an_undocumented_error_or_takes_a_second() -> None:
    for name, _, refused, longest, findings in fuzz(50, seed=7):
        assert not findings, (name, findings[:3])
        assert longest < LONGEST
        assert refused > 0 or name.startswith("stamp"), f"{name}: nothing was refused, so the inputs are too tame"
