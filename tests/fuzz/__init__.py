"""A fuzzer that is led by coverage (atheris, on libFuzzer) for every reader of files from others: `make fuzz SECONDS=60`.

===========  ===========================================================================================================
__main__     every reader for so long, what each came to, and what to do with a finding
one          one reader under atheris
corpus/      inputs that each reach something no smaller one of their folder does; kept small, tried by `test_corpus`
test_corpus  every input of the corpus again, in the tests that need no atheris
===========  ===========================================================================================================

Readers, and whole files to begin with, are those of `tests/torture` (`readers.py`, `wholes.py`). A finding is what ends in anything but a result or a named error,
takes more than 30 s, or more than 4 GB.
"""
