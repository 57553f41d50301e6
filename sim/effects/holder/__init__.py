"""Effects of what holds a tool in front of a spindle.

==============  ========================================================================================================
drawbar_force   the draw bar pulls with less than its force: contact stiffness falls with pressure
taper_contact   the taper touches over a part of its length: less stiff across, much less in tilt
==============  ========================================================================================================
"""
