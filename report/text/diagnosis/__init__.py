"""The diagnosis of a campaign of hammer tests.

======  =====================================
answer  everything as one JSON object
words   in sentences, and in the terminal
======  =====================================
"""
