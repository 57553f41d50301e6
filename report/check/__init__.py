"""What the program understands of a scene (the verb `check`): in numbers, in words, as a picture and as a page.

============ ============================================================================================================
drawing      the picture: half section with bearings and their load lines above, bodies, beams, joints and points below
looked       the states of a spindle that are asked what is odd about it
odd          what is odd about a scene, in a sentence each
odd_bearings of these what is odd about bearings, and what holds or presses them
page         the page, and the files of its folder
understood   parts, bearings, sets, shafts, points and hammer as one JSON object
words        the same in the terminal
============ ============================================================================================================
"""
