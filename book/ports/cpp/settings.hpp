// The parameters file of `match`.

#pragma once

#include <filesystem>

#include "parameters.hpp"
#include "se2.hpp"

namespace icp2d {

struct Settings {
    Pose initial;  // guess of T_target_source
    Parameters icp;
};

/// Reads a flat JSON object; a key that is missing keeps its default. Throws InputError.
Settings read_settings(const std::filesystem::path& file);

}  // namespace icp2d
