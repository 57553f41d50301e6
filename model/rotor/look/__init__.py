"""What a spindle looks like: cut-away bodies of its section, and the visual part of its MuJoCo model.

Nothing here enters the physics: geoms have no mass and collide with nothing, and bodies keep their explicit inertia. Meshes are plain arrays, so that the Rerun log shows
the same bodies. Regions hang on the body they move with, and turn with it: the stripe on the turning body shows how far.

=======  ============================================================================================
colours  which body a region of the section moves with, and which colour it has
dress    the looks of a MuJoCo model: solids, balls, lights and cameras
meshes   closed surfaces of regions, shafts, plates and stripes, cut away by a quarter
shafts   a cut-away slice of a flexible shaft for every node, which moves with it
=======  ============================================================================================
"""
