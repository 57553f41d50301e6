"""Effects on temperature and expansion.

==================  ====================================================================================================
expansion_mismatch  the hub's material, or that of the bearing rings or the shaft, expands more or less than its data
                    sheet says
loose_inserts       yoke and magnet hold the hub's expansion back less than bonded rings would: a weak bond, or left out
soak_lag            parts short of chamber temperature: the rotating part, reached by air only, has risen less than the
                    shaft and the balls
fixture_lag         the other way round: the standing part, bolted to a fixture that has not soaked, has risen less than
                    the turning one
thermal_gradient    the running bearings heat themselves: their friction leaves shaft and inner rings hotter than the
                    hub
cooling_imbalance   a cooled housing round a warm shaft
seat_friction       the rings' seats lose interference as they grow, and rub more: the bearings' damping rises with
                    temperature
==================  ====================================================================================================
"""
