// The lesson's kind of scene (section 6): an L of two walls and scatter, seen as points.

#pragma once

#include <random>

#include "se2.hpp"

namespace icp2d {

/// World points: two walls of 150 each, and 300 scattered over the rectangle they span.
Points simulate_world(std::mt19937& rng);

/// All world points in reach, in the scanner's frame, with noise and spurious returns.
Points simulate_scan(const Points& world, const Eigen::Isometry2d& T_world_scanner,
                     std::mt19937& rng);

}  // namespace icp2d
