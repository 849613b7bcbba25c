"""All numbers of the odometry that somebody chose: unit, reason, and the row that they buy.

What a run can measure is no constant: see `labkit.odometry.scales`. The rows are those of
``book/disturbances.md``; ``tests/bench/vary.md`` tells which of them a third more of each moves.
"""

from __future__ import annotations

import math

# What a run measures on itself (scales)
HISTORY = 40  # steps that a median is taken over
LEAST_WHEEL_ERROR = (0.03, math.radians(1.5))  # [m], [rad]: turns of good wheels have heavy tails
QUANTILE = 0.8  # of the wheels' errors: most steps go straight on, and turns err most: late wheels
USUAL_CHANGE = (0.5, math.radians(20.0))  # [m], [rad]: so much of a motion doubles the wheels'
# error, and so much do two motions in a row differ: every 2nd scan
UNUSUAL = 3.0  # times the usual: a match is expected within so many errors of the wheels, and no
# step leads farther than so many of the longest of the last motions
USUAL_LIMITS = (2.0, math.radians(90.0))  # [m], [rad]: of a step, where a user sets no limits

# Believing (propose, score, choose)
WHEEL_COST = 0.13  # of agreement, for each e-fold of a motion unlike the wheels': wheels slip
MOTION_COST = 0.05  # the same for a motion unlike the last ones: no wheels
SURE_SCORE = 0.8  # a match that scores as much needs no search; one that agrees as much may lie
# farther from the wheels than a step leads: wheels off by half a turn
SURE_SCORE_SLOPE = 1.0  # [1/m] of half the window around wheels, where that is less: every 2nd scan
MIN_SCORE = 0.1  # a match that scores less tells less than the wheels: gaps of 15 scans
AT_ONCE = 0.6  # of what the best match in the window lacks to a score of 1: a match outside lacks
# less, or it is not believed: a door, wheels jump
MARGIN = 0.05  # of agreement, or score: matches that differ by less fit equally well; far from
# the wheels none of them is believed: noise of 30 mm more
MIN_AGREEMENT = 0.45  # a match that agrees less measures no error of the wheels, nor is it believed
# far from them; where the usual one agrees less, these lead: every 2nd scan, clean, 30 % ghosts
LEAD_AGREEMENT = 0.6  # the same where matches do not bear the wheels out: a third moving

# Doubting (record)
MAX_ERROR = (0.1, math.radians(2.5))  # [m], [rad]: a step that may err by more is doubtful; twice
# as much is wrong: all rows

# Score of a place (score)
CLEARANCE = 0.3  # [m]: a beam must end this far behind a point to have looked through it
LOOKED_THROUGH_COST = 0.5  # of agreement, if beams look through all walls in view

# Wheels, and points that repeat (wheels, walls)
REST = (0.02, math.radians(0.5))  # [m], [rad]: wheels that tell less tell a stand
SAME_VIEW_SHARE = 0.9  # of a scan's points that repeat those of the scan before, at a stand
MIN_MOTION = (0.05, math.radians(2.0))  # [m], [rad]: what moves less tells no ratio
REPEAT_DISTANCE = 0.1  # [m]: a point repeats an earlier one that lies nearer; of walls that leave
# the map one point stays in each square of this side

# Map (local_map)
KEY_SCANS = 60  # whole in the map; of those before them it remembers the walls: clean logs
KEY_MOTION = (0.3, math.radians(20.0))  # [m], [rad]: a robot that went farther takes a key scan
MAP_CELL = 0.05  # [m]: a key scan keeps one point in each square of this size

# Search (search, and walls for its range)
CELL = 0.1  # [m]: side of a cell of the tables; a point one cell away counts exp(−½)
COARSE_CELLS = 4  # cells from one coarse pose to the next; a point farther away counts nothing
COARSE_TURN = math.radians(2.0)  # [rad] from one coarse pose to the next: no wheels
MAX_RANGE = 20.0  # [m]: points farther away move too far in a coarse turn; a search reaches half,
# and walls that are remembered count so far at least
MAX_POINTS = 100  # of the source that are looked up
MAX_COARSE_POSES = 200  # of the highest scores: a fine search goes on from them
MAX_STARTS = 8  # poses that are worth trying with ICP, of the fine search and of the expected
SAME_POSE = (0.3, math.radians(6.0))  # [m], [rad]: poses that differ by less count as one
SEARCH_FACTOR = 1.5  # reach of a search over the longest of the last motions, or the wheels' turn

# Records and remarks (record, remarks, run)
MIN_STEPS = 10  # of any statistic over a run: so many of a stated value stand in at first, and
# fewer odd ones get no remark
MIN_ODD_STEPS = 3  # scans that repeat, wheels that tell too much, or matches against the wheels in
# a row: fewer get no remark
MAX_LEFT = 0.5  # of the difference between scans and wheels: a cause that leaves less is told
WALL_VIEW = math.radians(30.0)  # of a stretch of beams that may show a wall
MAX_ROUGHNESS = 0.05  # of the ranges of a wall: how far they lie off a smooth curve; those of what
# the robot carries along lie as near to the first ones
KEPT_STEPS = 500  # tell the remark on a run that is driving now; in any run they keep their points,
# 35 kB each with 720 beams, and those before them their covariance, which takes 1 to 3 ms
RETRY_SHARE = 0.5  # of the gate and of each ICP step, in the lesson's second attempt
