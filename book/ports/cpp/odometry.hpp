// From increments to poses (section 5): where scan matching becomes odometry.

#pragma once

#include <optional>
#include <vector>

#include "icp.hpp"

namespace icp2d {

/// Moves `pose` by an increment given in its own frame: what ICP returns.
Pose integrate_step(const Pose& pose, const Pose& increment);

/// The poses from a start pose, which comes first, and K increments: K + 1 of them.
std::vector<Pose> integrate(const Pose& start, const std::vector<Pose>& increments);

/// What odometry remembers from one scan to the next.
struct Odometry {
    Parameters parameters;
    Pose pose;                            // of the last scan
    Pose last_motion;                     // the guess where there is no prior
    std::optional<Points> previous_scan;  // none before the first
};

/// Takes the newest scan and moves the pose; `prior` is the increment that wheels report.
///
/// Where matching fails, the prior is believed, or else the last motion, but that only once.
/// Returns the match, or nothing where there was nothing to match with.
std::optional<Result> step(Odometry& odometry, Points scan, std::optional<Pose> prior = {});

}  // namespace icp2d
