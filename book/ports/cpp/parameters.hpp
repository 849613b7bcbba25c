// Everything that the ICP loop can be told.

#pragma once

#include <Eigen/Core>

namespace icp2d {

struct Parameters {
    double max_correspondence_distance = 0.5;  // the gate [m]; infinity turns it off
    double overlap_ratio = 0.85;               // the share of the source that is kept, in (0, 1]
    double huber_delta = 0.2;                  // δ [m]; infinity weighs all pairs alike
    Eigen::Index max_iterations = 60;
    double translation_tolerance = 1e-6;  // m
    double rotation_tolerance = 1e-6;     // rad
    double cost_tolerance = 1e-12;        // m²; 0 turns the test off
};

/// Throws std::invalid_argument, with the value received, for one that is out of its range.
void require_valid(const Parameters& parameters);

}  // namespace icp2d
