// The tables of numbers that the commands read; no header, one row a line.

#pragma once

#include <filesystem>
#include <vector>

#include "alignment.hpp"
#include "se2.hpp"

namespace icp2d {

/// Rows x,y: at least one.
Points read_points(const std::filesystem::path& file);

/// Rows px,py,qx,qy or px,py,qx,qy,w: at least one.
Pairs read_pairs(const std::filesystem::path& file);

/// Rows dx,dy,dtheta; there may be none.
std::vector<Pose> read_increments(const std::filesystem::path& file);

}  // namespace icp2d
