"""The diagnosis of a campaign of hammer tests.

=======  ====================================================================================
answer   everything as one JSON object
doubts   what speaks against the effects that a verdict names
granted  what explains data that the drawing misses where no effect is missing
words    in sentences, and in the terminal
=======  ====================================================================================
"""
